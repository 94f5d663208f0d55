"""Physics may hand back plain numbers wherever it hands numbers back: the engine spreads them over the lanes."""

import numpy as np
import pytest
from flown_models import FOLDER, flown, same_bytes

from mc_engine.model import load_model

LIFTS = np.linspace(-1.0, 2.0, 5)


@pytest.fixture(
    scope="module",
    params=[
        "FixedStep(0.1, 20.0, control_every=5)",
        pytest.param("AdaptiveStep(20.0, control_period=0.5)", marks=pytest.mark.slow),
    ],
)
def model(request, tmp_path_factory):
    """The stone of plain numbers with each kind of clock."""
    folder = tmp_path_factory.mktemp("plain")
    text = (FOLDER / "plain_numbers.py").read_text()
    text = text.replace("FixedStep(0.1, 20.0, control_every=5)", request.param)
    (folder / "stone.py").write_text(text.replace("Field, FixedStep", "Field, AdaptiveStep, FixedStep"))
    return load_model("stone.py", folder)


@pytest.mark.parametrize("style", [0.0, 1.0, 2.0])
def test_plain_numbers_in_any_branch_fly_in_lanes_as_they_fly_alone(model, style):
    alone, lanes = (flown(model, width, lift_m_s2=LIFTS, style=style) for width in (1, 8))
    assert set(alone["status"]) == {"ok"}
    assert len(set(alone["end_time_s"])) == LIFTS.size
    same_bytes(alone, lanes)


def test_a_derivative_of_plain_numbers_alone_is_every_lanes(model):
    columns = flown(model, 8, lift_m_s2=LIFTS, style=3.0)
    np.testing.assert_allclose(columns["end_v_m_s"], -20.0, rtol=1e-12)
    np.testing.assert_array_equal(columns["end_x_m"], 10.0)
