"""The figures of one kind that a report draws: the model's own, or without any, what the run itself suggests."""

from collections.abc import Iterator

import numpy as np

from mc_engine.model.figures import HistoryFigure, ProfileFigure, ScatterFigure
from reports.run.flown import Flown
from reports.run.phases import quantity_names
from reports.text.numbers import capitalised

MOST_SCATTERS = 4


def history_figures(flown: Flown) -> list[HistoryFigure]:
    """The model's histories; of a model without any, one of all saved quantities."""
    own = [figure for figure in flown.figures if isinstance(figure, HistoryFigure)]
    if own or any(isinstance(figure, ProfileFigure) for figure in flown.figures):
        return own
    saved = quantity_names(flown.histories)
    return [HistoryFigure(tuple(saved), "Saved time histories")] if saved else []


def scatter_figures(flown: Flown) -> list[ScatterFigure]:
    """The model's scatter plots; of a model without any, the metrics that matter over their strongest inputs.

    Without an input that surely contributes to a metric, over the one that seems to.
    """
    own = [figure for figure in flown.figures if isinstance(figure, ScatterFigure)]
    return own or list(_suggested(flown))[:MOST_SCATTERS]


def _suggested(flown: Flown) -> Iterator[ScatterFigure]:
    for metric in flown.key_metrics:
        if flown.summaries[metric].constant or not flown.summaries[metric].n_used:
            continue
        found = flown.contributions
        acting, strongest = ([], []) if found is None else (found.acting(metric), found.strongest(metric))
        ranked = [contributor.name for contributor in flown.contributors(metric)]
        for name in sorted(ranked, key=lambda name: name not in acting):
            if np.isfinite(flown.values(name)).any():
                what = "its strongest contributor, " if name in strongest else ""
                title = f"{flown.words(metric)} over {what}{flown.words(name)}"
                yield ScatterFigure(name, metric, capitalised(title))
                break
