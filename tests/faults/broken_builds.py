"""Builds of the engine that are broken on purpose, to see that the tests of faults would notice.

A break is a function of `patch`, which sets an attribute: `setattr` in a process that is thrown away, or that of a
MonkeyPatch.
"""

import os
from contextlib import suppress
from dataclasses import asdict, replace

from mc_engine import durable_file
from mc_engine.flight.chunks import Lost, Task
from mc_engine.runner import dispatch
from mc_engine.store import parts, store
from mc_engine.store.writer_lock import WriterLock


def line_before_part(patch):
    """The journal counts a part before the part has its name."""

    def publish(self, *written):
        with self.lock():
            self._record("part", *(asdict(one.part) for one in written))
            self._rename(*written)

    patch(store.Store, "publish", publish)


def dead_worker_forgotten(patch):
    """Nobody flies again what a dead worker was flying."""
    patch(dispatch.Dispatch, "_on_worker_death", lambda self, result: None)


def suspects_given_up(patch):
    """All cases that were in flight when a worker died are blamed for its death."""

    def without_all(self, cases):
        lost = tuple(Lost(int(case), "worker-died", dispatch.DIED) for case in cases)
        return replace(self, suspected=True, lost=(*self.lost, *lost))

    patch(Task, "isolating", without_all)


def disk_unheard(patch):
    """What the disk says when it cannot write is not heard."""

    def write_synced(root, name, content, told=None):
        with open(root / name, "wb", buffering=0) as file, suppress(OSError):
            durable_file.write_all(file.fileno(), content)
            os.fsync(file.fileno())

    patch(durable_file, "write_synced", write_synced)
    patch(parts, "write_synced", write_synced)


def contents_unsynced(patch):
    """Files get their names before their bytes are on the disk."""

    def write_synced(root, name, content, told=None):
        with open(root / name, "wb", buffering=0) as file:
            file.write(content)

    patch(durable_file, "write_synced", write_synced)
    patch(parts, "write_synced", write_synced)


def names_unsynced(patch):
    """A journal line is written before the name of its part is on the disk."""
    patch(durable_file, "_sync_names", lambda folder: None)


def digests_unread(patch):
    """The bytes of a part are not compared with the checksum in the journal."""
    patch(parts, "content_problem", lambda content, part: "")


def unlocked(patch):
    """Everybody may write."""
    patch(WriterLock, "acquire", lambda self: None)


BREAKS = {
    one.__name__: one
    for one in (
        line_before_part,
        dead_worker_forgotten,
        suspects_given_up,
        disk_unheard,
        contents_unsynced,
        names_unsynced,
        digests_unread,
        unlocked,
    )
}
