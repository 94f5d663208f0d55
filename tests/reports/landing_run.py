"""A run made up for tests of footprints, corridors, profiles and compared choices: a capsule that comes down."""

import numpy as np
import pandas as pd
from synthetic_run import SyntheticRun, manifest

from mc_engine.statistics.geodesy import LocalPlane

COLUMNS = [
    ("case_id", "", "case", "number of the case"),
    ("status", "", "case", "how the case ended"),
    ("reason", "", "case", "why it was refused"),
    ("law", "", "dispersion", "guidance law"),
    ("angle_deg", "deg", "dispersion", "flight-path angle at entry"),
    ("speed_m_s", "m/s", "dispersion", "speed at entry"),
    ("latitude_deg", "deg", "metric", "latitude of the end"),
    ("longitude_deg", "deg", "metric", "longitude of the end"),
    ("end_altitude_km", "km", "metric", "altitude of the end"),
    ("peak_load_g", "g", "metric", "largest load"),
    ("exits", "", "metric", "how often the vehicle left"),
]
FOOTPRINT = {
    "kind": "footprint",
    "latitude": "latitude_deg",
    "longitude": "longitude_deg",
    "title": "Where the flights end",
    "ends_below": ["end_altitude_km", 30.0],
    "planet": "planet",
    "target": None,
}
CORRIDOR = {
    "kind": "corridor",
    "x": "speed_m_s",
    "y": "angle_deg",
    "metrics": ["peak_load_g", "exits"],
    "title": "Entry corridor",
}
PROFILE = {"kind": "profile", "x": "speed_m_s", "y": "altitude_km", "title": "Altitude against speed"}
REQUIREMENTS = [
    {"name": "load", "metric": "peak_load_g", "at_most": 9.0, "at_least": None, "share": 0.9, "confidence": 0.9},
    {"name": "inside", "metric": "exits", "at_most": 0.0, "at_least": None, "share": 0.9, "confidence": 0.9},
]


def landing_run(n=1000, failed=10, place=(54.0, 179.9), laws=("none",), flights=25, **changes):
    """`n` cases per law, all laws on the same draws; the last `failed` failed.  Steeper is shorter and heavier."""
    draw = np.random.Generator(np.random.Philox(key=5))
    angle = np.tile(draw.normal(-2.0, 0.05, n), len(laws))
    speed = np.tile(draw.normal(7800.0, 5.0, n), len(laws))
    scatter = np.tile(draw.normal(0.0, 5e3, n), len(laws))
    law = np.repeat(np.array(laws, dtype=object), n)
    gain = np.array([1.0 / (1 + laws.index(word)) for word in law])
    along = gain * (8e5 * (angle + 2.0) + 300.0 * (speed - 7800.0))
    latitude, longitude = LocalPlane(*place).places(
        np.column_stack([0.8 * along - 0.6 * scatter, 0.6 * along + 0.8 * scatter])
    )
    ok = np.arange(angle.size) < angle.size - failed
    metrics = {
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "end_altitude_km": np.where(angle > -1.88, 120.0, 10.0),
        "peak_load_g": 8.7 - 4.0 * (angle + 2.0) + 0.02 * (speed - 7800.0),
        "exits": np.where(angle > -1.88, 1.0, 0.0),
    }
    table = pd.DataFrame(
        {
            "case_id": np.arange(angle.size),
            "status": np.where(ok, "ok", "not-finite"),
            "reason": np.where(ok, "", "lost"),
            "law": law,
            "angle_deg": angle,
            "speed_m_s": speed,
            **{name: np.where(ok, values, np.nan) for name, values in metrics.items()},
        }
    )
    nominal = {"case_id": -1, "status": "ok", "law": laws[0], "angle_deg": -2.0, "speed_m_s": 7800.0,
               "latitude_deg": place[0], "longitude_deg": place[1], "end_altitude_km": 10.0, "peak_load_g": 8.7,
               "exits": 0.0}  # fmt: skip
    record = manifest(
        **{
            "columns": [dict(zip(("name", "unit", "role", "description"), one, strict=True)) for one in COLUMNS],
            "quantities": [{"name": "altitude_km", "unit": "km", "description": "altitude"}],
            "requirements": REQUIREMENTS,
            "figures": [CORRIDOR, FOOTPRINT, PROFILE],
            "published": [],
            "inputs": [],
            **changes,
        }
    )
    return SyntheticRun(record, table, nominal, descents(flights))


def descents(flights):
    """Histories of the nominal and the first cases: down to 60 km, up to 70 km, down to 10 km, slower all the time."""
    t = np.linspace(0.0, 1.0, 201)
    altitude = np.interp(t, [0.0, 0.4, 0.6, 1.0], [120.0, 60.0, 70.0, 10.0])
    frames = []
    for case in range(-1, flights):
        speed = (7000.0 + 10.0 * case) * (1.0 - 0.9 * t)
        frames.append(pd.DataFrame({"case_id": case, "t_s": 500.0 * t, "altitude_km": altitude, "speed_m_s": speed}))
    return pd.concat(frames, ignore_index=True)
