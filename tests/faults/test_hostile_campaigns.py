"""Campaign files that are broken or meant to break: one sentence and exit status 2, within two seconds."""

import numpy as np
import pytest
from mutated_campaigns import lay_out, mutate
from processor_time import seconds
from typer.testing import CliRunner

from mc_engine.command_line.commands import app

SEED = 20161109
FEW, ALL = 240, 20_000  # mutations
HANG_S = 2.0
VALID, REFUSED = 0, 2


@pytest.fixture(scope="module")
def bases(tmp_path_factory):
    """Base -> (path, text); every base is valid, and its model loaded, before it is mutated."""
    laid_out = lay_out(tmp_path_factory.mktemp("campaigns"))
    for path, text in laid_out.values():
        path.write_text(text, encoding="utf-8")
        assert checked(path)[0] == VALID, text[:200]
    return laid_out


def checked(path):
    """(exit status, all that was said, processor time [s]) of `mc-engine check --no-model` in this process."""
    answers = []
    duration = seconds(lambda: answers.append(CliRunner().invoke(app, ["check", "--no-model", str(path)])), HANG_S)
    answer = answers[-1]
    assert answer.exception is None or isinstance(answer.exception, SystemExit), repr(answer.exception)
    return answer.exit_code, answer.output, duration


def cases_of(bases, count, offset):
    """(number, generator, path, text): the bases in turn, each number with random numbers of its own."""
    laid_out = list(bases.values())
    for number in range(offset, offset + count):
        path, text = laid_out[number % len(laid_out)]
        yield number, np.random.default_rng([SEED, number]), path, text


@pytest.mark.parametrize("count", [FEW, pytest.param(ALL * 3 // 4, marks=pytest.mark.slow)])
def test_a_mutated_campaign_is_refused_in_sentences_or_is_still_a_campaign(bases, count, record_property):
    refused, longest = 0, 0.0
    for number, rng, path, text in cases_of(bases, count, 0):
        kind, content = mutate(text, rng)
        path.write_bytes(content)
        status, said, duration = checked(path)
        where = f"mutation {number}, {kind}, of {path.parent.name}: {said[:500]}"
        assert status in (VALID, REFUSED), where
        longest = max(longest, duration)
        assert duration < HANG_S, where
        assert "Traceback" not in said, where
        assert all(letter.isprintable() or letter == "\n" for letter in said), where
        refused += status == REFUSED
    record_property("mutations", count)
    record_property("refused", refused)
    record_property("longest [s]", longest)
    assert refused > 0.7 * count  # the others exchange lines or values that may be exchanged
