from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chisquare, spearmanr

from mc_engine.sampling.designs import (
    EXTENSIBLE,
    IN_BLOCKS,
    RANDOM,
    block_problem,
    block_size,
    extension_problem,
    grid_levels,
    level_count,
    one_at_a_time_levels,
    unit_cube,
)

NAMES = ("ve", "oe", "mass", "delay")
PAIRS = (("ve", "mass", 0.5), ("oe", "mass", -0.3))


def _cube(design, cases, n_cases=300, seed=1, names=NAMES, pairs=PAIRS):
    return np.array(unit_cube(design, seed, names, np.asarray(cases), n_cases, pairs))


@pytest.mark.parametrize("design", [*RANDOM, *IN_BLOCKS])
@given(data=st.data())
@settings(max_examples=20)
def test_cases_in_any_order_and_any_chunks_are_the_same_cases(design, data):
    order = data.draw(st.permutations(range(60)))
    cuts = sorted(data.draw(st.lists(st.integers(0, 60), max_size=5)))
    pieces = [_cube(design, piece) for piece in np.split(np.array(order), cuts)]
    assert np.concatenate(pieces, axis=1).tobytes() == _cube(design, range(60))[:, order].tobytes()


@pytest.mark.parametrize("design", EXTENSIBLE)
def test_a_thousand_cases_extended_to_two_thousand_are_a_fresh_two_thousand(design):
    first, later = _cube(design, range(1000), 1000), _cube(design, range(1000, 2000), 2000)
    fresh = _cube(design, range(2000), 2000)
    assert np.concatenate([first, later], axis=1).tobytes() == fresh.tobytes()


# Written down once, as the numbers of `test_streams`: of cases 0, 1 and 17 of 20 with seed 20160421.
CONTRACT = {
    "mc": [[0.39567765469958927, 0.8556476477968407, 0.4239227037302796],
           [0.2311132163418289, 0.235535356607942, 0.047209818952994476]],
    "lhs": [[0.2697838827349795, 0.34278238238984204, 0.921196135186514],
            [0.06155566081709145, 0.9617767678303972, 0.6023604909476498]],
    "sobol": [[0.5067717955830132, 0.27434764416872026, 0.3138378113866319],
              [0.8851065391956012, 0.11286831295862498, 0.37288007806402224]],
    "saltelli": [[0.8335848665160742, 0.08808014579817847, 0.27051445727870693],
                 [0.4118938641508044, 0.4118938641508044, 0.6952603224920023]],
    "morris": [[0.125, 0.125, 0.625], [0.625, 0.125, 0.375]],
}  # fmt: skip
CORRELATED = {  # of the second dispersion, with a rank correlation of 0.5 to the first one
    "mc": [0.22184816903557802, 0.47310533724808357, 0.06296686562879909],
    "lhs": [0.06155566081709145, 0.9451488353944104, 0.9617767678303972],
    "sobol": [0.8499650337355082, 0.08900271129850706, 0.2985864679769545],
}


@pytest.mark.parametrize("design", CONTRACT)
def test_the_numbers_of_a_design_are_those_of_the_seed_contract(design):
    def drawn(pairs=()):
        return _cube(design, [0, 1, 17], 20, 20160421, ("ve_pct", "oe_deg"), pairs).tolist()

    assert drawn() == CONTRACT[design]
    if design in RANDOM:
        first, second = drawn((("oe_deg", "ve_pct", 0.5),))
        assert first == CONTRACT[design][0]
        assert second == pytest.approx(CORRELATED[design], rel=1e-13)


@pytest.mark.parametrize("design", RANDOM)
def test_a_dispersion_added_at_the_end_changes_no_other_number(design):
    before = _cube(design, range(300))
    after = _cube(design, range(300), names=(*NAMES, "new"), pairs=(*PAIRS, ("mass", "new", 0.4)))
    assert after[:4].tobytes() == before.tobytes()


def test_a_block_of_saltelli_is_two_points_and_one_mixed_of_them_for_each_dispersion():
    size = block_size("saltelli", len(NAMES))
    blocks = _cube("saltelli", range(50 * size), pairs=()).T.reshape(50, size, len(NAMES))
    a, b = blocks[:, 0], blocks[:, -1]
    assert (a != b).all()
    for k in range(len(NAMES)):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        assert (blocks[:, k + 1] == mixed).all()
    # A and B together are a sequence: in each half of every axis lies half of the points of 2**k blocks
    points = _cube("saltelli", range(64 * size), pairs=()).T.reshape(64, size, len(NAMES))[:, [0, -1]]
    assert ((points < 0.5).sum(axis=0) == 32).all()


def test_a_trajectory_of_morris_moves_every_dispersion_once_by_half_the_levels():
    size = block_size("morris", len(NAMES))
    blocks = _cube("morris", range(400 * size), pairs=()).T.reshape(400, size, len(NAMES))
    moved = blocks[:, 1:] != blocks[:, :-1]
    assert (moved.sum(axis=1) == 1).all()
    assert (moved.sum(axis=2) == 1).all()
    assert set(np.unique(blocks)) == {0.125, 0.375, 0.625, 0.875}
    assert set(np.unique(np.abs(np.diff(blocks, axis=1))[moved])) == {0.5}
    # where each dispersion begins, its turn among the moves and its direction are a matter of chance, all alike
    for k in range(len(NAMES)):
        turn = moved[:, :, k].argmax(axis=1)
        rises = (np.diff(blocks[:, :, k], axis=1).sum(axis=1) > 0.0).astype(int)
        for choice in ((4.0 * blocks[:, 0, k]).astype(int), turn, rises):
            assert chisquare(np.bincount(choice)).pvalue > 0.001, NAMES[k]


def test_a_number_of_cases_that_cuts_a_block_is_told_the_nearest_that_do_not():
    assert block_problem("saltelli", 4, 60) == block_problem("mc", 4, 61) == ""
    assert block_problem("saltelli", 4, 61).endswith("has blocks of 6 cases: 60 or 66 would fit")
    assert block_problem("morris", 4, 3).endswith("has blocks of 5 cases: 5 would fit")


@pytest.mark.parametrize(
    ("manifest", "cases", "message"),
    [
        ({}, 1001, ""),
        ({}, 1000, "is to have 1000 cases already"),
        ({}, 999, "is to have 1000 cases already"),
        ({"campaign": {"design": "lhs"}}, 2000, 'the design "lhs" cannot be extended; mc, sobol, saltelli, morris can'),
        ({"shard": {"number": 1, "of": 2}}, 2000, "is a shard"),
        ({"upstream": {}}, 2000, "takes its inputs from another run"),
    ],
)
def test_a_run_is_extended_to_more_cases_by_designs_whose_first_cases_stay(manifest, cases, message):
    problem = extension_problem({"campaign": {"design": "mc"}, **manifest}, 1000, cases)
    assert problem.startswith(message)
    assert bool(problem) == bool(message)


@pytest.mark.parametrize("design", [*RANDOM, *IN_BLOCKS])
def test_another_seed_changes_every_number(design):
    other = _cube(design, range(300), seed=0) != _cube(design, range(300), seed=1)
    assert other.mean() > 0.7 if design == "morris" else other.all()  # four levels repeat


@pytest.mark.parametrize("design", RANDOM)
def test_every_design_reaches_the_rank_correlations(design):
    u = _cube(design, range(4000), 4000)
    target = [[1, 0, 0.5, 0], [0, 1, -0.3, 0], [0.5, -0.3, 1, 0], [0, 0, 0, 1]]
    assert spearmanr(u.T).statistic == pytest.approx(np.array(target), abs=0.05)


@pytest.mark.parametrize("pairs", [(), PAIRS])
def test_a_latin_hypercube_has_one_case_in_each_stratum_of_each_dispersion(pairs):
    u = _cube("lhs", range(300), pairs=pairs)
    assert (np.sort((u * 300).astype(int), axis=1) == np.arange(300)).all()


@pytest.mark.parametrize("design", ["lhs", "sobol"])
def test_spread_designs_estimate_a_mean_better_than_chance(design):
    def error(design):
        means = [_cube(design, range(256), 256, seed=seed, pairs=()).sum(axis=0).mean() for seed in range(30)]
        return np.sqrt(np.mean((np.array(means) - 2.0) ** 2))

    assert error(design) < error("mc") / 5.0


@given(sizes=st.lists(st.integers(1, 4), max_size=4))
def test_a_grid_runs_through_all_combinations_the_last_fastest(sizes):
    cases = np.arange(level_count("grid", sizes))
    rows = list(zip(*(level.tolist() for level in grid_levels(sizes, cases)), strict=True)) if sizes else [()]
    assert rows == list(product(*(range(size) for size in sizes)))


def test_one_at_a_time_moves_one_dispersion_and_leaves_the_others_nominal():
    cases = np.arange(level_count("one_at_a_time", [2, 3]))
    first, second = one_at_a_time_levels([2, 3], cases)
    assert first.tolist() == [-1, 0, 1, -1, -1, -1]
    assert second.tolist() == [-1, -1, -1, 0, 1, 2]
