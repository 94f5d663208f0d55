import pytest

from mc_engine.suggestions import hint, nearest

DISTRIBUTIONS = ["normal", "uniform", "triangular", "lognormal", "beta"]


@pytest.mark.parametrize(
    ("word", "meant"),
    [("nromal", "normal"), ("Normal", "normal"), ("gaussian", "normal"), ("log-normal", "lognormal"), ("xyz", None)],
)
def test_the_nearest_word_is_found_or_none(word, meant):
    assert nearest(word, DISTRIBUTIONS) == meant


def test_another_name_is_offered_only_where_its_word_is_allowed():
    assert nearest("gaussian", ["uniform", "beta"]) is None


def test_a_hint_asks_back_or_lists_a_few_words_or_counts_many():
    assert hint("unifrom", DISTRIBUTIONS) == '; did you mean "uniform"?'
    assert hint("xyz", ["a", "b"]) == '; known are "a", "b"'
    assert hint("xyz", ["only"]) == '; known is "only"'
    assert hint("foo 48", [f"name {k}" for k in range(50)]).startswith('; 50 are known, nearest are "name 48", ')
    assert hint("xyz", []) == ""
