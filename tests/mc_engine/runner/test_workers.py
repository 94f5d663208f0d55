import os
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


def _page_faults(memory: str, **environment: str) -> int:
    command = [sys.executable, "-c", _PAGE_FAULTS, memory]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, **environment})
    return int(ran.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other allocators have limits of their own")
@pytest.mark.parametrize("environment", [{}, {"MALLOC_TRIM_THRESHOLD_": "65536"}], ids=["plain", "as a Dask worker"])
def test_the_arrays_of_a_chunk_take_the_memory_of_the_chunk_before(environment):
    assert _page_faults("kept", **environment) < 100 < _page_faults("given back", **environment)
