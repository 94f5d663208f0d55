import platform
import subprocess
import sys

import pytest

_PAGE_FAULTS = """
import resource, sys
import numpy as np
from mc_engine.runner.workers import keep_freed_memory

def fly(): return [np.ones(100_000) for _ in range(8)]

if sys.argv[1] == "kept": keep_freed_memory()
fly()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20): fly()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def _page_faults(memory: str) -> int:
    ran = subprocess.run([sys.executable, "-c", _PAGE_FAULTS, memory], capture_output=True, text=True, check=True)
    return int(ran.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other allocators have limits of their own")
def test_the_arrays_of_a_chunk_take_the_memory_of_the_chunk_before():
    assert _page_faults("given back") > 100
    # on a busy machine one process in some hundred did not keep it
    assert min(_page_faults("kept") for _ in range(3)) < 100
