"""The shipped campaigns as parameters of tests: one of each model and design; the others are slow."""

import tomllib

import pytest

from mc_engine.campaign.search import list_campaigns


def samples(tunings=True):
    """Names; of those whose model and design an earlier one has, marked as slow.  tunings : also those that tune."""
    known, parameters = set(), []
    for campaign in list_campaigns():
        document = tomllib.loads(campaign.path.read_text())
        kind = document["campaign"]["model"], document["campaign"]["design"], "tuning" in document
        if tunings or "tuning" not in document:
            parameters.append(pytest.param(campaign.name, marks=[pytest.mark.slow] if kind in known else []))
        known.add(kind)
    return parameters
