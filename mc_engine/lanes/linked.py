"""A numba pipeline for functions that are used inside kernels only: it stops at LLVM's intermediate language.

numba optimises each function and generates its machine code, then does so again for the function that it is inlined
into.  A kernel's parts are never called by themselves, so they are optimised once, with the kernel around them.  This
halves the time of compilation and changes neither results nor speed.  It replaces internal steps of numba, in this
file alone.
"""

from typing import Any

from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

from mc_engine.lanes.call_frame import KernelCalls, PartCalls, calling_by, refuse_missing_blocks


@register_pass(mutates_CFG=True, analysis_only=False)
class LinkedLowering(NativeLowering):
    """Lower a function to a library that can be linked, and cannot be run."""

    _name = "linked_lowering"

    def run_pass(self, state: Any) -> bool:
        """Called by numba with the state of the compilation."""
        if state.library is None:
            state.library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
            state.library.enable_object_caching()
        library = state.library
        library._optimize_final_module = _leave_alone
        library._finalize_final_module = lambda: _finish(library)
        state.flags.no_compile = True
        super().run_pass(state)
        key: Any = [].append  # numba finds the function by a built-in that is like no other; nothing calls it
        state["cr"] = state.cr._replace(cfunc=key)
        state.targetctx.insert_user_function(key, state.cr.fndesc, [library])
        return True


class LinkedCompiler(CompilerBase):
    """numba's own pipeline with `LinkedLowering` in the place of its last step."""

    def define_pipelines(self) -> list[Any]:
        """Called by numba once per function."""
        calling_by(PartCalls, self.state.targetctx)
        return [_with_last_step(self.state, LinkedLowering)]


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):
    """Lower a kernel to a library that is complete: what its parts name of one another is there."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """Called by numba with the state of the compilation."""
        library = state.library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
        library.enable_object_caching()
        optimise = library._optimize_final_module

        def check_and_optimise() -> None:
            refuse_missing_blocks(library._final_module)
            optimise()

        library._optimize_final_module = check_and_optimise
        return super().run_pass(state)


class KernelCompiler(CompilerBase):
    """numba's own pipeline for a kernel, which hands its data over to its parts."""

    def define_pipelines(self) -> list[Any]:
        """Called by numba once per function."""
        calling_by(KernelCalls, self.state.targetctx)
        return [_with_last_step(self.state, KernelLowering)]


def _with_last_step(state: Any, last: Any) -> Any:
    manager = DefaultPassBuilder.define_nopython_pipeline(state)
    manager.passes = [(last if step is NativeLowering else step, text) for step, text in manager.passes]
    manager.finalize()
    return manager


def _leave_alone() -> None:
    """In place of the optimisation of a library."""


def _finish(library: Any) -> None:
    """In place of the machine code of a library: it counts as finished."""
    library._finalize_dynamic_globals()
    library._finalized = True
