"""The picture that a replay leaves."""

from io import BytesIO

import numpy as np
import pandas as pd
import pytest

from mc_engine.studies.replay_files import history_figure


@pytest.mark.parametrize("last", [1e308, -1e308, np.inf, np.nan])
def test_a_flight_that_is_lost_is_drawn_as_far_as_axes_go(last):
    history = pd.DataFrame({"case_id": 5, "t_s": [0.0, 1.0, 2.0], "height_m": [3.0, 2.0, last]})
    figure = history_figure(history, [{"name": "height_m", "unit": "m"}], "case 5")
    picture = BytesIO()
    figure.savefig(picture, format="png")
    (line,) = figure.axes[0].lines
    assert np.array_equal(line.get_ydata(), [3.0, 2.0, np.nan], equal_nan=True)
    assert picture.getvalue().startswith(b"\x89PNG")
