"""A model that contradicts itself is refused when it is made, in one sentence."""

from dataclasses import replace
from pathlib import Path

import pytest

from mc_engine.errors import ModelError
from mc_engine.model import Event, Extremum, Field, Parameter, load_model

WAVE = load_model("wave.py", Path(__file__).resolve().parent / "lanes" / "adaptive")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"parameters": (Parameter("a_m", "m", "", 0.0), Parameter("a_s", "s", "", 0.0))}, 'two inputs .* called "a"'),
        ({"metrics": (Field("top_m", "m", ""), Field("top_m", "m", ""))}, 'two columns .* called "top_m"'),
        ({"extrema": (Extremum("top", "depth_m"),)}, 'extremum "top": there is no quantity "depth_m"'),
        ({"events": None}, "no function `events`"),
        ({"event_list": (Event("rise", "rising", "switch"),), "switch": None}, "no function `switch`"),
    ],
)
def test_a_model_that_contradicts_itself_is_refused(change, sentence):
    with pytest.raises(ModelError, match=sentence):
        replace(WAVE, **change)
