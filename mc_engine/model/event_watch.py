"""A variant of a model whose metrics are the extremes of its event functions, to check that each event can occur."""

from dataclasses import replace

from mc_engine.lanes import physics
from mc_engine.model.fields import Extremum, Field
from mc_engine.model.record import Model


@physics
def _reached(t, s, m, p, o, best, when):
    return best


def watching_events(model: Model) -> Model:
    """The same flight, with metrics `least_<event>` and `most_<event>`: the extremes of each event's function at the
    steps.  The model must have events."""
    assert model.events is not None
    names = [event.name for event in model.event_list]
    kinds = [(f"{word}_{name}", name, kind) for name in names for word, kind in (("least", "min"), ("most", "max"))]
    return replace(
        model,
        quantities=tuple(Field(name, "", "the event's function") for name in names),
        observe=model.events,
        extrema=tuple(Extremum(name, event, kind, smooth=False) for name, event, kind in kinds),
        metrics=tuple(Field(name, "", "an extreme of an event's function") for name, _, _ in kinds),
        evaluate=_reached,
        figures=(),
        published=(),
        watching=True,
    )
