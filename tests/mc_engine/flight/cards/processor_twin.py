"""The code of a card's threads compiled for the processor: the same optimised LLVM IR, thread after thread.

Three things differ from what the card's back end is given: the target, the convention of the entry, and where it reads
the numbers of its block and thread, which here are arguments.
"""

import ctypes
import re

import llvmlite.binding as llvm
import numpy as np

from mc_engine.flight.card_code import ENTRY, PER_CASE, words_of

THREADS = 3  # of a block: not a divisor of most numbers of cases, so the last block has threads without one
_NUMBERS = ("ctaid", "ntid", "tid")


class ProcessorTwin:
    """The machine code of one module's entry.  n_words : that it takes."""

    def __init__(self, code):
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        text = re.sub(r"^target .*\n", "", code, flags=re.MULTILINE)
        self.n_words = int(re.search(r"byval\(\[(\d+) x i64\]\)", code)[1])
        text = re.sub(rf"define ptx_kernel void @{ENTRY}\(ptr [^%]*%words\)", f"define void @{ENTRY}(ptr %words)", text)
        text = re.sub(r"^declare .*@llvm\.nvvm\.read\.ptx\.sreg.*\n", "", text, flags=re.MULTILINE)
        text = text.replace("@llvm.nvvm.read.ptx.sreg.", "@number.").replace("ptx_kernel ", "")
        module = llvm.parse_assembly(text + _caller())
        host = llvm.Target.from_default_triple()
        features = llvm.get_host_cpu_features().flatten()
        self._machine = host.create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=2)
        module.triple, module.data_layout = llvm.get_process_triple(), str(self._machine.target_data)
        module.verify()
        self._engine = llvm.create_mcjit_compiler(module, self._machine)
        self._engine.finalize_object()
        kind = ctypes.CFUNCTYPE(None, *[ctypes.c_uint32] * 3, ctypes.c_void_p)
        self._entry = kind(self._engine.get_function_address("thread"))

    def fly(self, words, blocks, threads=THREADS):
        """Run every thread of a grid.  words : uint64[...], of `words_of`, with addresses in this process."""
        for block in range(blocks):
            for thread in range(threads):
                self._entry(block, threads, thread, words.ctypes.data)

    def fly_call(self, arguments):
        """Fly all cases of a kernel's call, whose arrays lie in this process."""
        addresses = [argument.ctypes.data for argument in arguments if isinstance(argument, np.ndarray)]
        n_cases = arguments[PER_CASE[1]].size
        self.fly(words_of(arguments, addresses, n_cases), -(-n_cases // THREADS))


def _caller():
    """The numbers of block and thread as variables of the module, and a function that sets them and calls the entry."""
    variables = [f"@of.{name} = internal global i32 0\n" for name in _NUMBERS]
    body = "{{\n  %v = load i32, ptr @of.{}\n  ret i32 %v\n}}\n"
    readers = [f"define i32 @number.{name}.x() {body.format(name)}" for name in _NUMBERS]
    stores = [f"  store i32 %{name}, ptr @of.{name}\n" for name in _NUMBERS]
    return f"""
{"".join(variables)}{"".join(readers)}
define void @thread(i32 %ctaid, i32 %ntid, i32 %tid, ptr %words) {{
{"".join(stores)}  call void @{ENTRY}(ptr %words)
  ret void
}}
"""
