import gc
import subprocess
import sys
from threading import Barrier, Thread

import pytest

from mc_engine.errors import ModelError
from mc_engine.garbage_collection import without_collection

PROGRAM = """
import atexit, gc, weakref
{begin}
searches = []

class InACycle:
    def __init__(self):
        self.itself = self
    def __del__(self):
        print("found")

class Finalized:
    pass

kept = Finalized()
weakref.finalize(kept, print, "finalized")
atexit.register(print, "registered")
gc.callbacks.append(lambda phase, _: searches.append(phase))
lasting = [[number] for number in range(100_000)]
print(len(searches), "searches")
InACycle()
"""


def ended(begin: str) -> list[str]:
    program = [sys.executable, "-c", PROGRAM.format(begin=begin)]
    return subprocess.run(program, capture_output=True, text=True, check=True, timeout=60).stdout.split("\n")


def test_a_command_does_not_search_its_objects_as_it_ends_but_runs_what_was_registered():
    own = "from mc_engine.garbage_collection import collect_rarely; collect_rarely()"
    assert ended(own) == ["0 searches", "registered", "finalized", ""]
    usual = ended("pass")
    assert usual[0] != "0 searches"
    assert usual[1:] == ["registered", "finalized", "found", ""]


def test_compilations_in_several_threads_leave_the_search_as_it_was():
    both, first_has_ended = Barrier(2), Barrier(2)
    searched = []

    def first():
        with without_collection():
            both.wait(10)
        searched.append(gc.isenabled())
        first_has_ended.wait(10)

    def second():
        both.wait(10)
        with without_collection():
            first_has_ended.wait(10)

    def overlapping():
        with without_collection():
            both.wait(10)
            first_has_ended.wait(10)

    assert gc.isenabled()
    for other in (second, overlapping):
        threads = [Thread(target=first), Thread(target=other)]
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
        assert gc.isenabled()
    assert searched[-1] is False  # as long as another one compiles


def test_a_compilation_that_fails_leaves_the_search_on():
    with pytest.raises(ModelError, match="is off"), without_collection(), without_collection():
        raise ModelError("is_on" if gc.isenabled() else "is off")
    assert gc.isenabled()
