from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.sampling import first_numbers
from mc_engine.sampling.streams import SEED_CONTRACT, stream, uniform_columns, uniforms

SEEDS = st.integers(0, 2**63 - 1)
NAMES = st.text(min_size=1, max_size=20)
CONTRACT_DRAWS = [0.39567765469958927, 0.8556476477968407, 0.6190736563696156]
CASES = st.lists(st.integers(0, 2**62), max_size=20)


@given(seed=SEEDS, name=NAMES, cases=CASES)
def test_each_uniform_is_the_first_number_of_its_stream_bit_for_bit(seed, name, cases):
    draws = uniforms(seed, name, np.array(cases, dtype=np.int64))
    assert draws.tolist() == [stream(seed, name, case).random() for case in cases]


def test_the_first_numbers_of_a_process_are_those_that_machine_code_draws_later(monkeypatch):
    names = ["ve_pct", "oe_deg", "a"]
    cases = np.random.default_rng(1).integers(0, 2**62, 20_000)
    drawn = {}
    for before, uses_machine_code in ((0, False), (first_numbers._MANY, True)):
        monkeypatch.setattr(first_numbers, "_drawn", before)
        first_numbers._machine_code.cache_clear()
        drawn[uses_machine_code] = uniform_columns(11, names, cases)
        assert (first_numbers._machine_code.cache_info().currsize == 1) == uses_machine_code
    assert drawn[False].tobytes() == drawn[True].tobytes()
    for place in (0, 1, cases.size - 1):
        assert drawn[True][:, place].tolist() == [stream(11, name, int(cases[place])).random() for name in names]


def test_pieces_of_a_long_run_are_drawn_by_machine_code_however_short_they_are(monkeypatch):
    monkeypatch.setattr(first_numbers, "_drawn", 0)
    first_numbers._machine_code.cache_clear()
    for piece in np.array_split(np.arange(first_numbers._MANY), 8):
        assert first_numbers._machine_code.cache_info().currsize == 0
        uniforms(7, "dv", piece)
    assert first_numbers._machine_code.cache_info().currsize == 1


def test_threads_that_ask_for_many_numbers_at_once_get_the_same(monkeypatch):
    monkeypatch.setattr(first_numbers, "_MANY", 1)
    first_numbers._machine_code.cache_clear()
    cases = np.arange(40_000)
    with ThreadPoolExecutor(8) as pool:
        columns = [*pool.map(lambda _: uniforms(7, "dv", cases).tobytes(), range(8))]
    assert set(columns) == {uniforms(7, "dv", cases).tobytes()}


def test_the_seed_contract_is_one_and_these_are_its_numbers():
    # Written down once; another number here is another seed contract, and stored runs cannot be repeated.
    assert SEED_CONTRACT == 1
    assert uniforms(20160421, "ve_pct", np.arange(3)).tolist() == CONTRACT_DRAWS


def test_the_order_in_which_cases_are_asked_for_does_not_matter():
    cases = np.random.default_rng(3).permutation(10_000)
    assert uniforms(7, "dv", cases).tobytes() == uniforms(7, "dv", np.arange(10_000))[cases].tobytes()


@pytest.mark.parametrize(("seed", "name"), [(1, "a"), (0, "b"), (2, "a")])
def test_another_seed_or_another_name_is_another_stream(seed, name):
    ours, theirs = uniforms(0, "a", np.arange(1000)), uniforms(seed, name, np.arange(1000))
    assert np.abs(np.corrcoef(ours, theirs)[0, 1]) < 0.1  # three sigma of 1000 independent pairs
    assert not np.isin(ours, theirs).any()
