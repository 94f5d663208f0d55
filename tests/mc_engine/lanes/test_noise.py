"""Philox4x32-10 against its published answers, and the draws that kernels make of it."""

import numpy as np
import pytest
from compiled_physics import WIDTHS, apply, bits, by_every_width
from scipy import stats

from mc_engine.lanes import physics
from mc_engine.lanes.noise import normal_pair
from mc_engine.lanes.philox import Draws, philox_words, uniform_pair

KEY = 0x299F31D0A4093822
# Random123 1.14, file tests/kat_vectors, lines "philox4x32 10": counter, key, answer
PUBLISHED = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("counter", "key", "answer"), PUBLISHED)
def test_philox_gives_the_published_words(counter, key, answer):
    assert philox_words(key[0] | key[1] << 32, counter) == answer


def fractions(case, sample, index=0, key=KEY):
    """The two uniform numbers, from the published generator alone: the top 52 of each 64 bits."""
    words = philox_words(key, (case & 0xFFFFFFFF, case >> 32, sample, index))
    return [((words[i] << 32 | words[i + 1]) >> 12) / 2.0**52 for i in (0, 2)]


@physics
def _draw(case, sample):
    draws = Draws(KEY, case, sample)
    a, b = uniform_pair(draws, 0)
    c, d = uniform_pair(draws, 1)
    e, f = normal_pair(draws, 0)
    return a, b, c, d, e, f


CASES = np.array([0, 1, 2, 7, 2**31, 2**32 - 1, 2**32, 2**40 + 3, 2**53 - 1], dtype=float)


@pytest.mark.parametrize("sample", [0, 1, 70_000, 2**32 - 1])
def test_draws_are_the_words_of_philox_at_the_address_of_case_sample_and_index(sample):
    ours = by_every_width(_draw, 6, CASES, float(sample))
    expected = [fractions(int(case), sample, 0) + fractions(int(case), sample, 1) for case in CASES]
    np.testing.assert_array_equal(ours[:4].T, expected)


@physics
def _draw_at_the_edges(case, sample):
    draws = Draws(KEY, case, sample)
    return *normal_pair(draws, -1), *uniform_pair(draws, 2**32 - 1), *uniform_pair(draws, 2**40 + 7)


@pytest.mark.parametrize("sample", [3.0, 2.0**32 + 5.0])
def test_indices_and_samples_count_by_their_last_32_bits_in_python_too(sample):
    cases = np.arange(8.0)
    ours = np.transpose([_draw_at_the_edges(case, sample) for case in cases.tolist()])
    np.testing.assert_array_equal(bits(by_every_width(_draw_at_the_edges, 6, cases, sample)), bits(ours))


def test_python_draws_the_same_bits_as_the_compiler():
    cases = np.arange(40.0)
    expected = np.transpose([_draw(case, 3.0) for case in cases.tolist()])
    np.testing.assert_array_equal(bits(by_every_width(_draw, 6, cases, 3.0)), bits(expected))


@pytest.fixture(scope="module")
def many():
    """float64[6, 100 000]: the draws of many cases at a few samples."""
    cases, samples = np.meshgrid(np.arange(20_000.0), np.arange(5.0))
    return apply(_draw, 6, cases.ravel(), samples.ravel(), 8)


def test_uniform_numbers_fill_the_interval_from_0_to_below_1(many):
    uniform = many[:4]
    assert uniform.min() >= 0.0
    assert uniform.max() < 1.0
    for row in uniform:
        assert stats.kstest(row, "uniform").pvalue > 1e-3


def test_normal_deviates_have_the_moments_and_the_distribution_of_the_normal_law(many):
    for row in many[4:]:
        n = row.size
        assert abs(row.mean()) < 4.0 / np.sqrt(n)
        assert abs(row.var() - 1.0) < 4.0 * np.sqrt(2.0 / n)
        assert abs((row**3).mean()) < 4.0 * np.sqrt(15.0 / n)
        assert abs((row**4).mean() - 3.0) < 4.0 * np.sqrt(96.0 / n)
        assert stats.kstest(row, "norm").pvalue > 1e-3
        # 1e5 deviates beyond 4 sigma: 6.3 are expected
        assert 1 <= np.count_nonzero(abs(row) > 4.0) <= 15


def test_draws_of_one_address_and_of_neighbouring_ones_are_uncorrelated(many):
    four_sigma = 4.0 / np.sqrt(many.shape[1])
    correlation = np.corrcoef(many[[0, 1, 2, 3]])
    assert abs(correlation - np.eye(4)).max() < four_sigma
    assert abs(np.corrcoef(many[4], many[5])[0, 1]) < four_sigma
    next_case, next_sample = np.roll(many[4], 1), np.roll(many[4], 20_000)
    assert abs(np.corrcoef(many[4], next_case)[0, 1]) < four_sigma
    assert abs(np.corrcoef(many[4], next_sample)[0, 1]) < four_sigma


@pytest.mark.parametrize("width", WIDTHS)
def test_a_case_draws_the_same_alone_and_in_any_company(width):
    cases = np.random.default_rng(5).permutation(64).astype(float)
    together = apply(_draw, 6, cases, 2.0, width)
    alone = np.column_stack([apply(_draw, 6, [case], 2.0, width)[:, 0] for case in cases])
    np.testing.assert_array_equal(bits(together), bits(alone))
