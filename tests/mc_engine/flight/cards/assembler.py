"""NVIDIA's assembler `ptxas`, of the wheel nvidia-cuda-nvcc-cu12 or of a toolkit, and what it says of a kernel."""

import importlib.util
import re
import shutil
import subprocess
import tempfile
from collections import namedtuple
from functools import cache
from pathlib import Path

# of the entry : registers of a thread; of all functions: bytes of the stack, of spill stores and of spill loads
Resources = namedtuple("Resources", "registers stack spill_stores spill_loads")


def ptxas():
    """Path of the assembler; None where there is none."""
    if importlib.util.find_spec("nvidia") is not None:
        spec = importlib.util.find_spec("nvidia.cuda_nvcc")
        for folder in spec.submodule_search_locations if spec is not None else ():
            if (program := Path(folder) / "bin" / "ptxas").is_file():
                return str(program)
    return shutil.which("ptxas")


@cache  # campaigns that differ in their inputs alone share a kernel
def assembled(ptx, capability):
    """The resources of a kernel's code.  Raises CalledProcessError where the assembler refuses it."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "kernel.ptx"
        source.write_text(ptx)
        words = [ptxas(), "-v", f"-arch=sm_{capability}", "-o", str(source.with_suffix(".cubin")), str(source)]
        said = subprocess.run(words, capture_output=True, text=True, check=True)
    text = said.stdout + said.stderr
    sizes = re.findall(r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads", text)
    sums = (sum(map(int, column)) for column in zip(*sizes, strict=True))
    return Resources(int(re.search(r"Used (\d+) registers", text)[1]), *sums)
