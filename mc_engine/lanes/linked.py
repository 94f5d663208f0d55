"""A numba pipeline for functions that are used only inside kernels: it stops at LLVM's intermediate language.

numba links each function with all that it calls, optimises the whole and generates its machine code, and repeats this
for every function that calls it.  The parts of a kernel are never called alone, so here each is linked once, into the
kernel, and optimised with it.  This halves the compilation time and changes neither results nor speed.  Only this file
replaces internal steps of numba.
"""

from collections.abc import Iterable
from typing import Any

from llvmlite import binding
from numba.core import errors
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, _pass_registry, register_pass
from numba.core.lowering import Lower
from numba.core.transforms import canonicalize_cfg
from numba.core.typed_passes import NativeLowering, NopythonRewrites

from mc_engine.lanes.aligned_stack import align
from mc_engine.lanes.call_frame import KernelCalls, PartCalls, calling_by, refuse_missing_blocks

_MANY_BLOCKS = 400  # of one function; only the loop of a flight has as many


class PartLibrary(JITCodeLibrary):
    """A function that can be linked, and cannot be run."""

    _whole: Any = None

    def _optimize_functions(self, ll_module: Any) -> None:
        """As numba's own, without the functions that are only declared, which are three of four.

        The time of some passes grows faster than the function: for a large one they are left to those of the kernel.
        """
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration:
                is_large = sum(1 for _ in function.blocks) > _MANY_BLOCKS
                passes, builder = self._few_passes() if is_large else self._codegen._function_pass_manager()
                passes.run(function, builder)

    def _few_passes(self) -> tuple[Any, Any]:
        passes = binding.create_new_function_pass_manager()
        passes.add_instruction_combine_pass()
        passes.add_sroa_pass()
        passes.add_simplify_cfg_pass()
        return passes, self._codegen._pass_builder()

    def finalize(self) -> None:
        """Called by numba when nothing is added any more."""
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def alone(self) -> Any:
        """The module of this function, without what it calls."""
        return super()._get_module_for_linking()

    def _get_module_for_linking(self) -> Any:
        """The module with all that the function needs, for a caller that numba links by its own rules."""
        if self._whole is None:
            self._whole = self.alone.clone()
            for library in _callers_first(self._linking_libraries):
                self._whole.link_in(_alone(library), preserve=True)
        return self._whole


class KernelLibrary(JITCodeLibrary):
    """A kernel, which is complete: what its parts name of one another is there."""

    def finalize(self) -> None:
        """Called by numba when nothing is added any more: link all parts, optimise, generate machine code."""
        for library in _callers_first(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(_alone(library), preserve=True)
        self._linking_libraries = []
        super().finalize()

    def _optimize_final_module(self) -> None:
        refuse_missing_blocks(self._final_module)
        super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        """Without numba's own linker: the kernel is loaded from its object file, here and in other processes."""
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    @property
    def whole(self) -> Any:
        """The module with all that the kernel needs, as it came out of numba's passes for this processor."""
        return self._final_module

    @property
    def outside_names(self) -> list[str]:
        """Names of the functions that the kernel calls and does not hold, such as that of math.gamma."""
        declared = (function.name for function in self._final_module.functions if function.is_declaration)
        return sorted(name for name in declared if not name.startswith("llvm."))

    def object_file(self) -> bytes:
        """The machine code."""
        return bytes(self._codegen._tm.emit_object(self._final_module))


def _callers_first(libraries: Iterable[Any]) -> list[Any]:
    """The libraries and all that they need, each once: LLVM takes over a function that something before it calls."""
    found: dict[Any, None] = {}

    def visit(library: Any) -> None:
        if library not in found:
            for needed in getattr(library, "_linking_libraries", ()):
                visit(needed)
            found[library] = None

    for library in libraries:
        visit(library)
    return list(reversed(found))


def _alone(library: Any) -> Any:
    return library.alone if isinstance(library, PartLibrary) else library._get_module_for_linking()


class SharedLower(Lower):
    """A part that is not inlined has a stack of its own."""

    def pre_lower(self) -> None:
        """Called by numba at the beginning of the function."""
        super().pre_lower()
        align(self.builder)


@register_pass(mutates_CFG=True, analysis_only=False)
class LinkedLowering(NativeLowering):
    """Lower a function to a library that can be linked, and cannot be run."""

    _name = "linked_lowering"
    lowering_class = Lower

    def run_pass(self, state: Any) -> bool:
        """Called by numba with the state of the compilation."""
        if state.library is None:
            state.library = PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.enable_object_caching()
        state.flags.no_compile = True
        self.lowering_class = Lower if state.flags.forceinline else SharedLower
        super().run_pass(state)
        key: Any = [].append  # numba finds the function by a built-in that is like no other; nothing calls it
        state["cr"] = state.cr._replace(cfunc=key)
        state.targetctx.insert_user_function(key, state.cr.fndesc, [state.library])
        return True


class LinkedCompiler(CompilerBase):
    """numba's own pipeline with `LinkedLowering` in the place of its last step, see `_pipeline`."""

    def define_pipelines(self) -> list[Any]:
        """Called by numba once per function."""
        calling_by(PartCalls, self.state.targetctx)
        return [_pipeline(self.state, LinkedLowering)]


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):
    """Lower a kernel to a library that is complete."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """Called by numba with the state of the compilation."""
        state.library = KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        state.library.finalize()
        return True


class KernelCompiler(CompilerBase):
    """numba's own pipeline for a kernel, which hands its data over to its parts."""

    def define_pipelines(self) -> list[Any]:
        """Called by numba once per function."""
        calling_by(KernelCalls, self.state.targetctx)
        return [_pipeline(self.state, KernelLowering)]


class _Passes(PassManager):
    """numba's passes, without what it does between two of them for its own debugging.

    numba reports each pass as an event with all flags in it, times it, checks the function after it, and computes anew
    how long every variable lives, which nothing asks for before the last but one pass does so itself.
    """

    def _runPass(self, index: int, pss: Any, internal_state: Any) -> None:
        """Called by numba, once for each pass of each function."""
        pss.analysis = self._analysis
        with errors.new_error_context("Pass {name}", name=pss.name()):  # type: ignore[attr-defined]
            pss.run_initialization(internal_state)
            has_changed = pss.run_pass(internal_state)
            pss.run_finalizer(internal_state)
        if has_changed and _pass_registry.get(type(pss)).mutates_CFG:
            internal_state.func_ir.blocks = canonicalize_cfg(internal_state.func_ir.blocks)


def _pipeline(state: Any, last: Any) -> Any:
    """numba's own with another last step, and without a search for array expressions, of which kernels have none."""
    usual = DefaultPassBuilder.define_nopython_pipeline(state).passes
    manager = _Passes("nopython")
    kept = [(step, text) for step, text in usual if step is not NopythonRewrites]
    manager.passes = [(last if step is NativeLowering else step, text) for step, text in kept]
    manager.finalize()
    return manager
