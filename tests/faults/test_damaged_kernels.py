"""A bit that flips in the cache of compiled kernels: the kernel is compiled anew, and the numbers are the same."""

import random

import pytest
from falling import engine, falling, table

from mc_engine.lanes.kernel_cache import kept_or_made


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """(folder with a campaign, the bytes of its cases, its cache: path -> content)."""
    folder = falling(tmp_path_factory.mktemp("campaign"))
    fly(folder, "whole")
    cache = {path: path.read_bytes() for path in (folder / "cache").rglob("*") if path.is_file()}
    return folder, table(folder / "whole"), cache


def fly(folder, run):
    words = ["run", folder, "--workers", 1, "--no-report", "--out", folder / run]
    done = engine(*words, cwd=folder, MC_ENGINE_CACHE=str(folder / "cache"))
    assert done.returncode == 0, done.stderr
    return done


def flies_the_same_after(flown, name, flips):
    """flips : (file, byte, bit) each."""
    folder, cases, cache = flown
    for number, (path, place, bit) in enumerate(flips):
        for other, content in cache.items():
            other.write_bytes(content)
        damaged = bytearray(cache[path])
        damaged[place] ^= 1 << bit
        path.write_bytes(damaged)
        done = fly(folder, f"{name}_{number}")
        assert table(folder / f"{name}_{number}") == cases
        assert (f"{path.name} is damaged there; it is made again" in done.stderr) == (path.suffix == ".kernel")
        assert path.read_bytes() == cache[path] or path.suffix == ".kernel"


def test_a_flipped_bit_in_a_compiled_kernel_or_in_its_source_changes_no_number(flown):
    (source,) = [path for path in flown[2] if path.suffix == ".py"]
    (kernel,) = [path for path in flown[2] if path.suffix == ".kernel" and path.parent == source.parent]
    flies_the_same_after(flown, "few", [(kernel, len(flown[2][kernel]) // 2, 3), (source, 700, 7)])


def test_a_kernel_in_the_place_of_another_is_compiled_anew(tmp_path):
    """All kernels of a processor and a width have the same file name, each in its own folder."""
    paths = [tmp_path / name / "kernel_w16.0123.kernel" for name in ("first", "second")]
    contents = [kept_or_made(path, path.parent.name.encode)[0] for path in paths]
    paths[0].write_bytes(paths[1].read_bytes())
    assert [kept_or_made(path, path.parent.name.encode) for path in paths] == [
        (contents[0], True),
        (contents[1], False),
    ]


@pytest.mark.slow
def test_a_hundred_flipped_bits_of_the_cache_change_no_number(flown):
    chance, files = random.Random(17), sorted(flown[2])
    flips = []
    for _ in range(100):
        path = chance.choice(files)
        flips.append((path, chance.randrange(len(flown[2][path])), chance.randrange(8)))
    flies_the_same_after(flown, "many", flips)
