"""Code for the threads of a graphics card, in NVIDIA's assembly language PTX, from a kernel for one case at a time.

The code is the kernel's LLVM IR, called by an entry that selects the case of the thread.  The entry takes a row of
8-byte words: the number of cases, then one word for each number that the kernel takes, in its order; an array is its
address and its shape.  A thread has the index of one case.  In arrays that hold one number a case it advances the
address to this index, so that the kernel sees arrays with one case.  Time histories are left out: their array is empty.

The IR is optimised once, for the oldest cards.  The back end of llvmlite writes PTX from the result, without permission
to contract operations.  It then writes each operation with its rounding, such as `mul.rn.f64`, and `fma.rn.f64` only
where the IR has an fma.  The assembler of the driver contracts only operations without a rounding.  So a card computes
the same as a processor, operation by operation.  The PTX is checked: an operation without a rounding is an error.
"""

import re
from collections.abc import Sequence
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np

from mc_engine.errors import EngineError, ModelError
from mc_engine.lanes.kernel_cache import Form, Kernel, form_of, kept_or_made

TRIPLE = "nvptx64-nvidia-cuda"
CAPABILITIES = (80, 90, 100)  # of the cards whose code is written: Ampere, Hopper, Blackwell; later cards run these
OLDEST = CAPABILITIES[0]
_UNROUNDED = re.compile(r"^\s*((?:add|sub|mul|fma|mad|div|sqrt|rcp)(?:\.\w+)*?\.f(?:32|64))\b", re.MULTILINE)
_REMARK = re.compile(r"[ \t]*//.*")  # counts the calls that a process has written: the driver keeps code by its text
ENTRY = "mc_engine_fly"
PER_CASE = (0, 4, -7, -6, -5, -4)  # of a kernel's arguments: parameters, cases; time, status, state, metrics
HISTORY, STATUS = -3, -6
FAILED = -1.0  # status of a case whose flight ended with an error, which the processor raises
_THREAD = ("ctaid", "ntid", "tid")  # block, threads of a block, thread of the block
_OF_THE_PROCESSOR = (
    (r"^(?:attributes|!|target|source_filename).*\n", ""),  # attributes, metadata, target
    (r'^ *call void asm sideeffect "", .*\n', ""),  # alignment of the stack
    (r"^ *(?:tail )?call void @llvm\.experimental\.noalias\.scope\.decl.*\n", ""),
    (r", ![\w.]+ !\d+", ""),
    (r" #\d+", ""),
    (r"^define (?:linkonce_odr |weak_odr )?(?:dso_local )?", "define internal "),
    (r"^(@.* = )(?:common|weak_odr|linkonce_odr) ", r"\1internal "),
)
_OF_THE_PROCESSOR_ONLY = {
    "pow", "powi", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "exp2", "exp10",
    "log", "log2", "log10", "ldexp", "frexp", "sincos", "modf",
}  # fmt: skip
_CHOICE = re.compile(
    r"^ *(%\S+) = select (i1|<\d+ x i1>) ([^,]+), (double|<\d+ x double>) (<[^>]*>|[^,]+), \4 (<[^>]*>|[^,\n]+)(.*)$",
    re.MULTILINE,
)


def thread_code(kernel: Kernel, arguments: Sequence[Any]) -> str:
    """LLVM IR of the entry and of all that it calls, optimised; kept on the disk beside the kernel.

    kernel : for one case at a time.  arguments : what it is called with; their form counts.
    """
    form = form_of(arguments)
    file = kernel.file(form, "threads", _version())
    kept, _ = kept_or_made(file, lambda: _made(*kernel.library(form), form).encode())
    return kept.decode()


@cache
def _version() -> str:
    """What the code depends on beside the kernel: this module, and the compiler's release."""
    return f"{llvm.llvm_version_info} {sha256(Path(__file__).read_bytes()).hexdigest()}"


def _made(name: str, library: Any, form: Form) -> str:
    text = str(library.whole)
    for pattern, plain in _OF_THE_PROCESSOR:
        text = re.sub(pattern, plain, text, flags=re.MULTILINE)
    text = re.sub(rf"^(define .*@{name}\(.*) {{$", r"\1 alwaysinline {", text, flags=re.MULTILINE)
    # numba's names hold addresses in this process, and the driver keeps what it has compiled by its text
    parts = re.findall(r"^define .*?@([\w.]+)\(", text, flags=re.MULTILINE)
    names = {part: f"part_{number}" for number, part in enumerate(parts)}
    text = re.sub(r"@([\w.]+)", lambda found: f"@{names.get(found[1], found[1])}", text)
    return _optimised(f'target triple = "{TRIPLE}"\n{text}\n{_entry(names[name], form)}')


def words_of(arguments: Sequence[Any], addresses: Sequence[int], n_cases: int) -> np.ndarray:
    """uint64[...], what the entry takes.

    arguments : of the kernel.  addresses : of its arrays, in their order, where the threads find them.
    """
    words, places = [np.array([n_cases], dtype=np.uint64)], iter(addresses)
    for argument in arguments:
        if isinstance(argument, np.ndarray):
            words.append(np.array([next(places), *argument.shape], dtype=np.uint64))
        else:
            words.append(np.array([argument]).view(np.uint64))
    return np.concatenate(words)


def _entry(name: str, form: Form) -> str:
    """The entry, as text: every thread calls the kernel `name` with its case."""
    n, calls = len(form), _Words()
    per_case = {index % n for index in PER_CASE}
    for index, word in enumerate(form):
        kind, bracket, axes = word.partition("[")
        if bracket:
            calls.places[index] = calls.array(1 + axes.count(","), index in per_case, index == HISTORY % n)
        else:
            calls.number("double" if kind == "float64" else "i64")
    lines = [f"  %{word} = call i32 @llvm.nvvm.read.ptx.sreg.{word}.x()\n" for word in _THREAD]
    lines += [f"  %{word}.64 = zext i32 %{word} to i64\n" for word in _THREAD]
    declared = [f"declare i32 @llvm.nvvm.read.ptx.sreg.{word}.x()\n" for word in _THREAD]
    return f"""
{"".join(declared)}
define ptx_kernel void @{ENTRY}(ptr byval([{calls.count} x i64]) align 8 %words) {{
  %result = alloca i64
  %errors = alloca ptr
{"".join(lines)}  %before = mul i64 %ctaid.64, %ntid.64
  %case = add i64 %before, %tid.64
  %offset = mul i64 %case, 8
  %n = load i64, ptr %words
  %is_case = icmp ult i64 %case, %n
  br i1 %is_case, label %fly, label %end
fly:
{"".join(calls.lines)}  %error = call i32 @{name}(ptr %result, ptr %errors, {", ".join(calls.values)})
  %has_error = icmp ne i32 %error, 0
  br i1 %has_error, label %failed, label %end
failed:
  store double {FAILED}, ptr {calls.places[STATUS % n]}
  br label %end
end:
  ret void
}}
"""


class _Words:
    """The words of the entry as a kernel takes them.

    lines : that read them.  values : of the call.  places : the first item of each argument that is an array.
    count : of words so far.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.values: list[str] = []
        self.places: dict[int, str] = {}
        self.count = 1  # the number of cases

    def number(self, kind: str) -> None:
        """A number of the kernel's own."""
        self.values.append(f"{kind} {self._word(kind)}")

    def array(self, n_axes: int, per_case: bool, is_empty: bool) -> str:
        """The place of an array, handed over as two owners, count, size of an item, address, shape and steps [bytes].

        per_case : the thread's case alone.  is_empty : whatever its shape.
        """
        address = self._word("i64")
        if per_case:
            self.lines.append(f"  {address}.own = add i64 {address}, %offset\n")
            address += ".own"
        # in the card's own memory; on a processor all memory is one
        self.lines.append(f"  {address}.global = inttoptr i64 {address} to ptr addrspace(1)\n")
        self.lines.append(f"  {address}.ptr = addrspacecast ptr addrspace(1) {address}.global to ptr\n")
        shape = [self._word("i64") for _ in range(n_axes)]
        steps, count = ["8"], shape[0]
        if n_axes == 2:
            count = f"{shape[1]}.count"
            self.lines.append(f"  {count} = mul i64 {shape[0]}, {shape[1]}\n")
            self.lines.append(f"  {shape[1]}.step = mul i64 {shape[1]}, 8\n")
            steps.insert(0, f"{shape[1]}.step")
        if is_empty:
            shape, count = ["0"] * n_axes, "0"
        elif per_case and n_axes == 1:
            shape, count = ["1"], "1"
        self.values += ["ptr null", "ptr null", f"i64 {count}", "i64 8", f"ptr {address}.ptr"]
        self.values += [f"i64 {value}" for value in (*shape, *steps)]
        return f"{address}.ptr"

    def _word(self, kind: str) -> str:
        name = f"%word.{self.count}"
        self.lines.append(f"  {name}.at = getelementptr i64, ptr %words, i64 {self.count}\n")
        self.lines.append(f"  {name} = load {kind}, ptr {name}.at\n")
        self.count += 1
        return name


def _optimised(text: str) -> str:
    """The module without what the entry does not need."""
    module = llvm.parse_assembly(text)
    module.verify()
    machine = target_machine(OLDEST)
    module.data_layout = str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.slp_vectorization = options.loop_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    _refuse_unknown([function.name for function in module.functions if function.is_declaration])
    optimised = str(module)
    # the back end writes x - trunc(x / y) * y, which differs from the remainder: 0.5 % 0.1 would be -3e-17, not 0.1
    if "= frem " in optimised:
        raise ModelError("physics takes a remainder of plain numbers, by %, // or divmod, which a card computes "
                         "otherwise; take floor of mc_engine.lanes, or fly on the processor")  # fmt: skip
    return choices_of_bits(optimised)


def _refuse_unknown(names: Sequence[str]) -> None:
    """ModelError for functions that a card has not: the back end would end the process."""
    for name in names:
        own = name.removeprefix("llvm.").split(".")[0]
        if own == name or own in _OF_THE_PROCESSOR_ONLY:
            raise ModelError(f'physics calls {own} on plain numbers, which a card has not; take that of '
                             "mc_engine.lanes, or fly on the processor")  # fmt: skip


def choices_of_bits(ir: str) -> str:
    """The module with each choice between two numbers as one between their bits.

    The back end takes `x < 0.0 ? x : 0.0` for a minimum, and a card's minimum of -0.0 and 0.0 is -0.0, not 0.0.
    """
    return _CHOICE.sub(_choice_of_bits, ir)


def _choice_of_bits(choice: re.Match[str]) -> str:
    name, truth, condition, kind, one, other, rest = choice.groups()
    bits, new = kind.replace("double", "i64"), f"%choice.{choice.start()}"
    return f"""  {new}.one = bitcast {kind} {one} to {bits}
  {new}.other = bitcast {kind} {other} to {bits}
  {new} = select {truth} {condition}, {bits} {new}.one, {bits} {new}.other{rest}
  {name} = bitcast {bits} {new} to {kind}"""


# ---- PTX


@lru_cache(maxsize=len(CAPABILITIES))
def target_machine(capability: int) -> Any:
    """LLVM's machine for cards of a compute capability, 80 for 8.0."""
    _begin()
    return llvm.Target.from_triple(TRIPLE).create_target_machine(cpu=f"sm_{capability}", opt=3)


def ptx_of(ir: str, capability: int) -> str:
    """The assembly of a module for cards of a compute capability and later ones.

    Raises EngineError where an operation could be contracted.
    """
    machine = target_machine(capability)
    text = machine.emit_assembly(llvm.parse_assembly(ir))
    loose = [name for name in _UNROUNDED.findall(text) if ".rn" not in name]
    if loose:
        release = ".".join(map(str, llvm.llvm_version_info))
        raise EngineError(f"LLVM {release} wrote {loose[0]} without a rounding, which a card may contract; another "
                          "release of llvmlite is needed")  # fmt: skip
    return _REMARK.sub("", text)


@lru_cache(maxsize=1)
def _begin() -> None:
    """Once in a process: LLVM's options are the process's own, and this one concerns cards alone."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    llvm.set_option("", "-nvptx-fma-level=0")
