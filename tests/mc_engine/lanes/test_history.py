"""Time histories of many cases at once: each lane records the rows of its own case, and nothing else."""

import numpy as np
import pytest
from flown_models import FOLDER, OSCILLATOR, RAIL, inputs_of, same_bytes

from mc_engine.flight import flight
from mc_engine.flight.flight import fly_histories, fly_history, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.model import load_model

RANDOM = np.random.default_rng(8)
N = 21  # two full batches of eight lanes and a part of one
WAVE = load_model("wave.py", FOLDER)
SAMPLED = {  # two periods of the control mixed, two cases that break, and one that is refused
    "rate_rad_s": RANDOM.uniform(0.5, 2.0, N),
    "x0_km": RANDOM.normal(size=N),
    "gain_1_s": RANDOM.uniform(0.0, 0.5, N),
    "noise_m_s2": np.where(np.arange(N) == 12, -1.0, 100.0),
    "breaks_at_s": np.where(np.isin(np.arange(N), (3, 17)), 2.05, 1e9),
    "every": np.where(np.arange(N) % 3 == 0, 3.0, 5.0),
}
BOUNCING = {  # walls and gates at times of their own; flights that end early, and on the grid
    "gravity_m_s2": RANDOM.uniform(5.0, 15.0, N),
    "x0_m": RANDOM.uniform(1.0, 6.0, N),
    "wall_m": np.zeros(N),
    "gate_s": RANDOM.uniform(0.0, 5.0, N),
    "gate_every_s": RANDOM.uniform(0.5, 2.0, N),
    "last_s": np.where(np.arange(N) % 4 == 0, RANDOM.uniform(1.0, 9.0, N), 1e9),
}
WAVING = {  # steps of their own, pushes, flights that end early, that break, and one with tens of thousands of steps
    "omega_rad_s": RANDOM.uniform(0.3, 3.0, N),
    "noise_m_s2": RANDOM.uniform(0.0, 0.1, N),
    "stop_s": np.where(np.arange(N) % 4 == 1, RANDOM.uniform(1.0, 40.0, N), 50.0),
    "ill": np.where(np.isin(np.arange(N), (2, 9)), 1.0, np.where(np.arange(N) == 14, 3.0, 0.0)),
}
FLIGHTS = [(OSCILLATOR, SAMPLED), (RAIL, BOUNCING), (WAVE, WAVING)]
NAMES = [model.name for model, _ in FLIGHTS]


def of_case(model, inputs, case):
    """The inputs of one case, with the model's defaults."""
    return inputs_of(model, {name: values[case] for name, values in inputs.items()})


@pytest.fixture(scope="module", params=FLIGHTS, ids=NAMES)
def recorded(request):
    """(model, inputs, what `fly_histories` gives for all cases, eight at a time)."""
    model, inputs = request.param
    flights = fly_histories(model, inputs_of(model, inputs), np.arange(N), 4, folder=FOLDER, width=8, rows=300)
    return model, inputs, list(flights)


def test_each_lane_records_the_rows_that_its_case_has_alone(recorded):
    model, inputs, flights = recorded
    assert len(flights) == N
    histories = [history["t_s"].tobytes() + history[model.quantities[0].name].tobytes() for _, history in flights]
    assert len(set(histories)) == N  # each case has another
    for case, (columns, history) in enumerate(flights):
        alone = fly_history(model, of_case(model, inputs, case), case, 4, folder=FOLDER, width=1, rows=300)
        same_bytes(columns, alone[0])
        same_bytes(history, alone[1])


def test_a_history_ends_where_its_case_ends_whatever_the_other_lanes_do(recorded):
    model, _, flights = recorded
    ends = {columns["end_time_s"][0] for columns, _ in flights}
    assert len(ends) > 4 if model is not OSCILLATOR else len(ends) > 1
    for columns, history in flights:
        if columns["status"][0] == "refused":
            assert history["t_s"].size == 0
        else:
            assert (history["t_s"][0], history["t_s"][-1]) == (0.0, columns["end_time_s"][0])
            assert np.isfinite(history["t_s"]).all()


@pytest.mark.parametrize("case", [0, 3, 5, 20])
@pytest.mark.parametrize(("model", "inputs"), FLIGHTS[:2], ids=NAMES[:2])
def test_a_flight_by_python_records_the_rows_of_a_lane(model, inputs, case):
    table = np.full((1 + len(model.quantities), 2000), np.nan)
    fly_interpreted(InterpretedFlight(model), of_case(model, inputs, case), case, 4, table)
    written = table[:, np.isfinite(table[0])]
    differs = np.append(True, (np.diff(written) != 0.0).any(axis=0))  # a history has no row twice
    one = fly_histories(model, inputs_of(model, inputs), np.arange(N), 4, folder=FOLDER, width=8, rows=2000)
    _, history = list(one)[case]
    factors = np.array([quantity.si_factor for quantity in model.quantities])
    for name, values in zip(history, written[:, differs] / np.append(1.0, factors)[:, np.newaxis], strict=True):
        assert history[name].tobytes() == np.ascontiguousarray(values).tobytes()


def histories_of(model, **inputs):
    """The histories of some cases that fly together, with room for all their rows."""
    inputs = inputs_of(model, {"until_s": 2.0} if model is RAIL else {}) | inputs
    flights = fly_histories(model, inputs, np.arange(5), 4, folder=FOLDER, width=8, rows=50_000)
    return [history for _, history in flights]


def test_adaptive_flights_with_more_rows_than_room_are_flown_again_with_room(monkeypatch):
    inputs = {"omega_rad_s": np.linspace(0.3, 3.0, 5), "stop_s": np.linspace(5.0, 50.0, 5)}
    expected = histories_of(WAVE, **inputs)
    monkeypatch.setattr(flight, "_USUAL_ROOM", 1)
    for history, other in zip(histories_of(WAVE, **inputs), expected, strict=True):
        same_bytes(history, other)


def test_a_flight_on_a_grid_has_room_for_any_number_of_events_in_a_step():
    """A gate every 0.007 s, in steps of 0.1 s, in one of five cases: 286 events."""
    every = np.array([1.0, 1.0, 0.007, 1.0, 1e9])
    histories = histories_of(RAIL, gate_s=0.0005, gate_every_s=every, x0_m=1.0, v0_m_s=1.0)
    for history, events in zip(histories, (2, 2, 286, 2, 1), strict=True):
        assert np.isin(history["t_s"], 0.1 * np.arange(21)).sum() == 21
        assert len(history["t_s"]) == 21 + events


def test_a_batch_with_more_rows_than_memory_flies_in_pieces(monkeypatch):
    inputs = {"gate_s": 0.0005, "gate_every_s": np.array([1.0, 0.05, 0.007, 1.0, 0.01]), "v0_m_s": 1.0}
    expected = histories_of(RAIL, **inputs)
    monkeypatch.setattr(flight, "_MOST_NUMBERS", 500)  # the rows of no two cases
    fly, together = flight._Recorder._fly_once, []

    def counted(recorder, chosen, *how):
        together.append(chosen.size)
        return fly(recorder, chosen, *how)

    monkeypatch.setattr(flight._Recorder, "_fly_once", counted)
    for history, other in zip(histories_of(RAIL, **inputs), expected, strict=True):
        same_bytes(history, other)
    assert together[0] == 5
    assert 5 <= len(together[1:]) <= 2 * 5  # each alone, and again where it has more rows than a grid has as a rule
    assert set(together[1:]) == {1}
