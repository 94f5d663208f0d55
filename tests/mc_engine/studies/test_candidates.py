"""Candidates flown side by side: the same as each alone, nominal or over the same dispersed cases."""

import threading

import numpy as np
import pytest
from apogee_tuning import apogee_and_speed, apogee_campaign

from mc_engine.campaign.cases import case_table
from mc_engine.flight.chunks import fly_cases, fly_in_threads
from mc_engine.studies import candidates
from mc_engine.studies.candidates import cases_per_candidate, fly_candidates

CHOICES = np.array([[300.0, 100.0], [250.0, 60.0], [600.0, 200.0], [400.0, 150.0], [200.0, 50.0]])
ROBUST = '\n[tuning.constraint.most]\nmetric = "apogee_altitude_km"\nquantile = {}\n{} = 700.0\n'


def scores_of(campaign, choices=CHOICES, workers=1):
    return fly_candidates(campaign, campaign.tuning, choices, workers)


def test_the_nominal_case_of_a_candidate_is_what_vis_viva_says():
    apogee, speed = apogee_and_speed(*CHOICES.T)
    scores = scores_of(apogee_campaign())
    np.testing.assert_allclose(scores.objectives, np.column_stack([apogee, speed]), rtol=1e-6)
    assert scores.failed.tolist() == [0] * 5
    assert scores.violation.tolist() == [0.0] * 5


def test_candidates_fly_alike_alone_together_and_by_two_threads():
    campaign = apogee_campaign(ROBUST.format(0.8, "at_least"))
    together = scores_of(campaign)
    for scores in (scores_of(campaign, workers=2), *(scores_of(campaign, CHOICES[k : k + 1]) for k in range(5))):
        rows = [row for row in together.limited.tolist() if row in scores.limited.tolist()]
        assert rows == scores.limited.tolist()
    assert cases_per_candidate(campaign, campaign.tuning) == 11


class Ending:
    """Flies nothing, and ends the process, as a model's `prepare` may."""

    batch, most_workers = 8, None

    def make_ready(self):
        """Nothing to compile."""

    def fly(self, inputs, noise):
        raise SystemExit("no licence")


def test_a_flight_that_ends_its_thread_is_not_waited_for():
    ends = []

    def fly():
        try:
            fly_in_threads(apogee_campaign(), {}, np.arange(64), [], 2, Ending())
        except SystemExit as end:
            ends.append(str(end))

    thread = threading.Thread(target=fly, daemon=True)
    thread.start()
    thread.join(20.0)
    assert ends == ["no licence"]


@pytest.mark.parametrize(
    ("quantile", "limit", "rank"),
    [(0.2, "at_least", 2), (0.2, "at_most", 1), (0.25, "at_least", 2), (0.25, "at_most", 2)],
)
def test_a_quantile_is_an_order_statistic_of_the_campaigns_own_cases(quantile, limit, rank):
    """Of 10 cases: never the better one of the two that a quantile lies between."""
    campaign = apogee_campaign(ROBUST.format(quantile, limit))
    flown = fly_cases(campaign, np.arange(10))["apogee_altitude_km"]  # the untuned choice, 300 km and 100 m/s
    scores = scores_of(campaign, CHOICES[:1])
    assert scores.limited[0, 0] == np.sort(flown)[rank]
    assert len(np.unique(case_table(campaign, np.arange(10))["magnitude_error_pct"])) == 10


@pytest.mark.parametrize(("limit", "worst"), [("at_least", -np.inf), ("at_most", np.inf)])
def test_a_failed_case_takes_the_worst_rank_and_all_candidates_have_the_same_noise(monkeypatch, limit, worst):
    campaign, flown = apogee_campaign(ROBUST.format(0.5, limit)), []

    def fly(campaign, inputs, noise, wanted, workers):
        columns = fly_in_threads(campaign, inputs, noise, wanted, workers)
        columns["status"][[1 + 3, 1 + 5]] = "no-stop"  # of the first candidate, beside its nominal case
        flown.append((noise, columns["apogee_altitude_km"]))
        return columns

    monkeypatch.setattr(candidates, "fly_in_threads", fly)
    scores = scores_of(campaign, CHOICES[:2])
    noise, apogees = flown[0][0].reshape(2, 11), flown[0][1].reshape(2, 11)[0, 1:]
    assert noise.tolist() == 2 * [[candidates.NOMINAL_NOISE, *range(10)]]
    apogees[[3, 5]] = worst
    assert scores.limited[0, 0] == np.sort(apogees)[5 if limit == "at_least" else 4]
    assert scores.failed.tolist() == [2, 0]


def test_the_violation_is_the_excess_in_shares_of_the_limits():
    limits = '\n[tuning.constraint.band]\nmetric = "apogee_altitude_km"\nat_least = 500.0\nat_most = 700.0\n'
    scores = scores_of(apogee_campaign(limits))
    apogee = scores.limited[:, 0]
    expected = np.maximum(0.0, np.maximum((apogee - 700.0) / 700.0, (500.0 - apogee) / 500.0))
    np.testing.assert_allclose(scores.violation, expected, rtol=1e-12)
    assert (scores.violation == 0.0).any()
    assert (scores.violation > 0.0).any()


def test_a_candidate_that_cannot_fly_has_no_number_and_an_infinite_violation():
    campaign = apogee_campaign(ROBUST.format(0.8, "at_least"))
    refused = np.array([[100.0, 100.0]])  # below the altitudes that the model accepts
    scores = scores_of(campaign, np.vstack([CHOICES[:1], refused]))
    assert np.isnan(scores.objectives[1]).all()
    assert np.isnan(scores.limited[1]).all()
    assert np.isinf(scores.violation[1])
    assert scores.failed.tolist() == [0, 11]
    assert scores.reasons.tolist() == ["", "refused: altitude_km is outside 150 to 2000 km"]
