"""Shards: independent pieces of a campaign, for example for the job array of a cluster.

The cases are divided into n consecutive, nearly equal pieces; shard k of n has the k-th, in its own run directory.  The
merged shards equal the run of one process: the same table and, with the same chunk, the same part files.
"""

import os
import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice, takewhile
from pathlib import Path

import numpy as np
import pyarrow as pa

from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.search import campaign_names
from mc_engine.errors import StoreError, UsageError
from mc_engine.flight.chunks import chunk_size, chunks_of
from mc_engine.flight.flyers import flyer_of
from mc_engine.interruption import in_threads
from mc_engine.runner.flown_campaign import campaign_of, companions_of
from mc_engine.runner.manifest import columns_of, manifest_of
from mc_engine.shell_words import shell_word
from mc_engine.store import parts
from mc_engine.store.opening import open_store
from mc_engine.store.parts import Part, Written
from mc_engine.store.receipts import gaps
from mc_engine.store.store import Store, create_store

_MOST_COMMANDS = 100  # that a sentence names
_TOGETHER = 4  # parts of each thread that are published together


@dataclass(frozen=True)
class Shard:
    """One of `of` pieces of a campaign; `number` counts from 1."""

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> "Shard":
        """The shard "3/20"; UsageError if it is none."""
        match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", str(text))
        shard = cls(*map(int, match.groups())) if match else cls(0, 0)
        if not 1 <= shard.number <= shard.of:
            raise UsageError(f'"{text}" is no shard; the third of twenty is 3/20')
        return shard

    def cases(self, n_cases: int) -> range:
        """The cases of this shard among `n_cases`, possibly none; two shards differ by at most one case."""
        return range(n_cases * (self.number - 1) // self.of, n_cases * self.number // self.of)

    def record(self, n_cases: int) -> dict[str, int]:
        """The shard's record in the manifest."""
        cases = self.cases(n_cases)
        return {"number": self.number, "of": self.of, "first": cases.start, "stop": cases.stop}


@dataclass(frozen=True)
class Piece:
    """The cases first .. stop - 1 of a part of a shard."""

    store: Store
    part: Part
    first: int
    stop: int

    def table(self) -> pa.Table:
        """All columns of these cases."""
        return parts.read_part(self.store.path, self.part).slice(self.first - self.part.first, self.stop - self.first)

    def between(self, first: int, stop: int) -> "Piece":
        """The part of this piece that lies in the cases first .. stop - 1."""
        return Piece(self.store, self.part, max(first, self.first), min(stop, self.stop))


def merge_shards(out: Path, folders: Sequence[Path], chunk: int | None, workers: int | None) -> tuple[Store, Campaign]:
    """Make a run directory with the cases of all shards.  Returns it and its campaign; `complete` adds the rest.

    folders : run directories of shards, in any order; they may overlap or be incomplete.  chunk : cases of a part;
    None: as in a run on all cores of this machine.  workers : threads; None: one per core.
    UsageError if cases are missing or the directories are not of one campaign; StoreError if two differ on a case.
    """
    stores = [open_store(folder) for folder in folders]
    _check_one_campaign(stores)
    _check_nothing_missing(stores)
    threads = workers or os.cpu_count() or 1
    _check_parts(stores, threads)  # before `out` is made
    pieces = list(_cover(stores))
    campaign = campaign_of(stores[0])
    run = create_store(out, manifest_of(campaign), campaign.text, columns_of(campaign), companions_of(campaign))
    size = chunk or chunk_size(campaign.cases, os.cpu_count() or 1, flyer_of(campaign))
    with run.lock():
        run.note("merged", shards=len(stores), chunk=size)
        bounds = [*chunks_of([(0, campaign.cases)], size)]
        for begin in range(0, len(bounds), _TOGETHER * threads):
            together = bounds[begin : begin + _TOGETHER * threads]
            run.publish(*in_threads(partial(_write_part, run, pieces), together, threads))
    return run, campaign


def _write_part(run: Store, pieces: Sequence[Piece], bounds: tuple[int, int]) -> Written:
    """The part of these cases, under a temporary name.  pieces : all cases, in order."""
    first, stop = bounds
    place = bisect_right(pieces, first, key=lambda piece: piece.stop)
    inside = takewhile(lambda piece: piece.first < stop, islice(pieces, place, None))
    table = pa.concat_tables([piece.between(first, stop).table() for piece in inside])
    columns = {name: table[name].to_numpy() for name in table.column_names}
    return parts.write_aside(run.path, run.columns, first, stop - first, columns)


def _check_one_campaign(stores: Sequence[Store]) -> None:
    def identity(store: Store) -> tuple[object, ...]:
        campaign, model = store.manifest["campaign"], store.manifest.get("model", {})
        digests = campaign.get("digest"), model.get("digest"), model.get("sampling_digest")
        return *digests, store.manifest.get("seed_contract"), campaign.get("seed"), store.n_cases

    for store in stores:
        if identity(store) != identity(stores[0]):
            raise UsageError(
                f"{store.path}: is not of the campaign of {stores[0].path}: another file, seed, number of cases, "
                "or other sources"
            )


def _check_parts(stores: Sequence[Store], threads: int) -> None:
    """StoreError that names the first part that is damaged or has other columns."""

    def problem(part: tuple[Store, Part]) -> StoreError | None:
        try:
            parts.read_part(part[0].path, part[1], stores[0].columns)
        except StoreError as error:
            return error
        return None

    for found in in_threads(problem, [(store, part) for store in stores for part in store.parts], threads):
        if found is not None:
            raise found


def _check_nothing_missing(stores: Sequence[Store]) -> None:
    """UsageError that names the command for every range of cases that no directory holds."""
    missing = gaps([piece for store in stores for piece in store.committed()], range(stores[0].n_cases))
    if not missing:
        return
    unfinished = dict.fromkeys(store.path for store in stores if store.missing() and _overlaps(missing, store.wanted))
    lines = [f"`mc-engine resume {shell_word(path)}`" for path in unfinished]
    lines += _commands_of_absent(stores, missing)
    cases = ", ".join(f"{first} to {stop - 1}" for first, stop in missing)
    raise UsageError(f"cases {cases} are missing; fly them with " + ", ".join(lines))


def _overlaps(missing: Sequence[tuple[int, int]], expected: range) -> bool:
    return any(first < expected.stop and expected.start < stop for first, stop in missing)


def _commands_of_absent(stores: Sequence[Store], missing: Sequence[tuple[int, int]]) -> list[str]:
    """A command for each shard, of as many as the given ones say there are, that has missing cases and no folder; for
    the first of them where they are many.  They fly the campaign file that a shard at hand keeps."""
    records = [store.manifest.get("shard") for store in stores]
    counts = {record["of"] for record in records if record}
    seed, file = stores[0].manifest["campaign"].get("seed"), _as_campaign(stores[0].path)
    n_cases = stores[0].n_cases
    commands = []
    for of in counts:
        there = {record["number"] for record in records if record and record["of"] == of}
        absent = (shard for shard in _shards_of(of, missing, n_cases) if shard.number not in there)
        commands += [
            f"`mc-engine run {file} --cases {n_cases} --seed {seed} --shard {shard.number}/{of} --out DIR`"
            for shard in islice(absent, _MOST_COMMANDS + 1)
        ]
    return [*commands[:_MOST_COMMANDS], *["and more"] * (len(commands) > _MOST_COMMANDS)]


def _as_campaign(folder: Path) -> str:
    """The word of a shell for the campaign in a folder, also where a shipped campaign has the folder's name."""
    return f"./{folder}" if str(folder) in campaign_names() else shell_word(folder)


def _shards_of(of: int, ranges: Sequence[tuple[int, int]], n_cases: int) -> Iterator[Shard]:
    """The shards that hold any case of the ranges, which are in order."""
    last = 0
    for case, stop in ranges:
        while case < stop:
            shard = Shard(-(-of * (case + 1) // n_cases), of)
            if shard.number > last:
                yield shard
            last, case = shard.number, shard.cases(n_cases).stop


def _cover(stores: Sequence[Store]) -> Iterator[Piece]:
    """Pieces with every case once, in order.  Cases that are in several shards are compared row by row."""
    pieces = [Piece(store, part, part.first, part.stop) for store in stores for part in store.parts]
    kept: list[Piece] = []
    for piece in sorted(pieces, key=lambda piece: (piece.first, -piece.stop)):
        covered = kept[-1].stop if kept else 0
        for before in reversed(kept):
            if before.stop <= piece.first:
                break
            _check_equal(before.between(piece.first, piece.stop), piece.between(before.first, before.stop))
        if piece.stop > covered:
            kept.append(piece.between(covered, piece.stop))
            yield kept[-1]


def _check_equal(a: Piece, b: Piece) -> None:
    if a.part.sha256 == b.part.sha256:
        return
    if parts.parquet_bytes(a.table()) != parts.parquet_bytes(b.table()):
        differ = np.flatnonzero([row_a != row_b for row_a, row_b in zip(_row_texts(a), _row_texts(b), strict=True)])
        where = f"{a.store.path} and {b.store.path}"
        raise StoreError(f"{where}: differ on case {a.first + int(differ[0])}; fly one of them anew")


def _row_texts(piece: Piece) -> list[str]:
    return [repr(row) for row in piece.table().to_pylist()]
