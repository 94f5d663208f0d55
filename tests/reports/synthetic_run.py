"""A run made up for tests of the reports: the de-orbit campaign's inputs, with its fuel in closed form.

S = (1 + 2 e^-2) |dv0| without gravity (digest of the paper, section 5); every other metric is a smooth function
of the same two inputs.  Has the reading half of a store's interface.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.store.opening import open_store
from mc_engine.store.store import Column, Store, create_store

BURN_M_S, ANGLE_RAD = 177.20997, 0.7715809
EXHAUST_M_S = 9.80665 * 246.0

COLUMNS = [
    ("case_id", "", "case", "number of the case"),
    ("status", "", "case", "how the case ended"),
    ("reason", "", "case", "why it was refused"),
    ("ve_pct", "%", "dispersion", "error of the burn's size, VE"),
    ("oe_pct", "%", "dispersion", "error of the burn's direction, OE"),
    ("correction_impulse_m_s", "m/s", "metric", "integral of the correction acceleration"),
    ("propellant_kg", "kg", "metric", "propellant that the correction takes"),
    ("peak_force_n", "N", "metric", "largest commanded force"),
    ("settling_time_s", "s", "metric", "last of a, e and ω inside 1 % of its first error"),
    ("max_position_error_m", "m", "metric", "largest distance from the wanted path"),
    ("entry_speed_m_s", "m/s", "metric", "speed at the entry interface"),
    ("entry_flight_path_angle_deg", "deg", "metric", "flight-path angle at the entry interface"),
    ("pulse_count", "", "metric", "pulses of the modulator"),
]
QUANTITIES = [
    ("semi_major_axis_error_km", "km", "error of the semi-major axis"),
    ("eccentricity_error", "", "error of the eccentricity"),
    ("force_n", "N", "commanded force"),
    ("position_error_m", "m", "distance from the wanted path"),
]


@dataclass
class SyntheticRun(Store):
    """What `mc_engine.store.store.open_store` gives to a report: of a run without replays, notes and flights beside."""

    manifest: dict[str, Any]
    table: pd.DataFrame
    nominal_row: dict[str, Any]
    history: pd.DataFrame = field(default_factory=pd.DataFrame)
    wanted: int = 0
    campaign_text: str = ""
    path = Path("/nowhere")
    columns: tuple[Any, ...] = ()
    parts: tuple[Any, ...] = ()

    def notes(self, event: str) -> list[Any]:
        return []

    @property
    def n_cases(self) -> int:
        return self.wanted or len(self.table)

    def cases(self) -> pd.DataFrame:
        return self.table.copy()

    def nominal(self) -> dict[str, Any]:
        return dict(self.nominal_row)

    def histories(self) -> pd.DataFrame:
        return self.history


def fly(ve: np.ndarray, oe: np.ndarray) -> dict[str, np.ndarray]:
    """Every metric of COLUMNS for float64[n] errors in percent."""
    s = 1.0 + ve / 100.0
    dv0 = BURN_M_S * np.sqrt(1.0 + s * s - 2.0 * s * np.cos(ANGLE_RAD * oe / 100.0))
    impulse = 1.2706706 * dv0
    return {
        "correction_impulse_m_s": impulse,
        "propellant_kg": 100.0 * (1.0 - np.exp(-impulse / EXHAUST_M_S)),
        "peak_force_n": 100.0 * 0.0175 * 2.0 * dv0,
        "settling_time_s": 350.0 + 0.4 * ve + 0.2 * oe,
        "max_position_error_m": 21.0218 * dv0,
        "entry_speed_m_s": 7800.0 + 1e-4 * dv0,
        "entry_flight_path_angle_deg": -2.0 + 1e-5 * ve * oe,
        "pulse_count": np.round(3.0 + dv0 / 12.0),
    }


def manifest(**changes: Any) -> dict[str, Any]:
    """A manifest as the runner writes it."""
    return {
        "format": 1,
        "engine": "0.2.0",
        "created_utc": "2026-04-21T10:15:00+00:00",
        "seed_contract": 1,
        "campaign": {
            "name": "deorbit",
            "title": "De-orbit correction after an erroneous burn",
            "model": "campaigns.deorbit",
            "design": "lhs",
            "seed": 20160421,
            "cases": 10_000,
            "digest": "3b1f" * 16,
        },
        "model": {
            "name": "deorbit",
            "title": "Feedback-linearised de-orbit correction",
            "source": "de-orbit paper, 2016",
            "digest": "9c2e" * 16,
        },
        "inputs": [
            {
                "name": "ve_pct",
                "unit": "%",
                "description": "error of the burn's size, VE",
                "nominal": 0.0,
                "distribution": "normal, 3σ = 20 %",
                "source": "abstract: 20 % in size",
            },
            {
                "name": "oe_pct",
                "unit": "%",
                "description": "error of the burn's direction, OE",
                "nominal": 0.0,
                "distribution": "normal, 3σ = 15 %",
                "source": "abstract: 15 % in angle",
            },
        ],
        "parameters": [
            {"name": "isp_s", "unit": "s", "description": "specific impulse", "value": 246.0, "overridden": True},
            {"name": "gain_1_s", "unit": "1/s", "description": "gain of the law", "value": 0.0175, "overridden": False},
        ],
        "settings": [
            {
                "name": "control",
                "unit": "",
                "description": "how the force is applied",
                "value": "continuous",
                "choices": ["continuous", "clipped", "pulsed", "off"],
            }
        ],
        "columns": [dict(zip(("name", "unit", "role", "description"), column, strict=True)) for column in COLUMNS],
        "quantities": [dict(zip(("name", "unit", "description"), column, strict=True)) for column in QUANTITIES],
        "requirements": [
            {
                "name": "fuel",
                "metric": "propellant_kg",
                "at_most": 2.5,
                "at_least": None,
                "share": 0.9973,
                "confidence": 0.9,
            },
            {
                "name": "force",
                "metric": "peak_force_n",
                "at_most": 100.0,
                "at_least": None,
                "share": 0.9973,
                "confidence": 0.9,
            },
            {
                "name": "settling",
                "metric": "settling_time_s",
                "at_most": 357.93,
                "at_least": None,
                "share": 0.9973,
                "confidence": 0.9,
            },
        ],
        "figures": [
            {
                "kind": "map",
                "metric": "propellant_kg",
                "x": "ve_pct",
                "y": "oe_pct",
                "title": "Correction fuel, fig. 10",
            },
            {"kind": "map", "metric": "correction_impulse_m_s", "x": "ve_pct", "y": "oe_pct", "title": "Impulse"},
            {
                "kind": "history",
                "quantities": ["semi_major_axis_error_km", "eccentricity_error", "force_n", "position_error_m"],
                "title": "Element errors and force",
            },
            {"kind": "scatter", "x": "correction_impulse_m_s", "y": "peak_force_n", "title": "Peak force and impulse"},
        ],
        "published": [
            {
                "quantity": "fuel of the worst case in fig. 10",
                "published": 3.8,
                "unit": "kg",
                "source": "section 5",
                "compute": "campaigns.deorbit.published:f",
                "tolerance": 0.05,
                "status": "legible",
                "reason": "needs VE = 40 %",
            },
            {
                "quantity": "entry speed",
                "published": 7.8,
                "unit": "km/s",
                "ours": 7.8,
                "tolerance": 0.05,
                "status": "legible",
                "note": "",
            },
            {
                "quantity": "impulse without error",
                "published": "zero",
                "unit": "m/s",
                "column": "correction_impulse_m_s",
                "status": "legible",
                "note": "",
            },
        ],
        "status_texts": {"ok": "completed"},
        "provenance": {
            "python": "3.11.7",
            "platform": "Linux x86_64",
            "cpu": "generic-avx512",
            "packages": {"numpy": "2.3.0", "scipy": "1.16.0"},
            "numba": "0.62",
            "llvm": "20.1",
            "git": {"commit": "0123456789abcdef0123456789abcdef01234567", "dirty": True},
        },
        **changes,
    }


def synthetic_run(n: int = 10_000, failed: int = 12, seed: int = 1, **changes: Any) -> SyntheticRun:
    """A run of `n` cases, the last `failed` of which ended not-finite; keywords change the manifest."""
    draw = np.random.Generator(np.random.Philox(key=seed))
    ve, oe = draw.normal(0.0, 20.0 / 3.0, n), draw.normal(0.0, 5.0, n)
    ok = np.arange(n) < n - failed
    metrics = {name: np.where(ok, values, np.nan) for name, values in fly(ve, oe).items()}
    table = pd.DataFrame(
        {
            "case_id": np.arange(n),
            "status": np.where(ok, "ok", "not-finite"),
            "reason": np.where(ok, "", "the guidance lost its way"),
            "ve_pct": ve,
            "oe_pct": oe,
            **metrics,
        }
    )
    zero = {name: float(values[0]) for name, values in fly(np.zeros(1), np.zeros(1)).items()}
    nominal = {"case_id": -1, "status": "ok", "reason": "", "ve_pct": 0.0, "oe_pct": 0.0, **zero}
    return SyntheticRun(manifest(**changes), table, nominal, histories(table))


def kept(
    folder: Path, manifest: dict[str, Any], table: pd.DataFrame, part: int = 7919, columns: Any = COLUMNS
) -> Store:
    """A run on the disk with these cases, in parts of so many."""
    kinds = {"case_id": "integer", **dict.fromkeys(("status", "reason", "law"), "word")}
    store = create_store(folder, manifest, "", [Column(*one, kinds.get(one[0], "number")) for one in columns])
    with store.lock():
        for first in range(0, len(table), part):
            rows = table.iloc[first : first + part]
            store.append(first, len(rows), {name: rows[name].to_numpy() for name in table.columns if name != "case_id"})
    return open_store(folder)


def histories(table: pd.DataFrame) -> pd.DataFrame:
    """Nominal, the first three cases and the five that burn most: x = v0 t exp(-k t)."""
    worst = table["propellant_kg"].fillna(-1.0).to_numpy().argsort()[::-1][:5]
    kept = [-1, *dict.fromkeys([*range(min(3, len(table))), *(int(row) for row in worst)])]
    t = np.linspace(0.0, 706.0, 707)
    frames = []
    for case in kept:
        dv0 = 0.0 if case < 0 else float(np.nan_to_num(table["peak_force_n"].iloc[case])) / 3.5
        shape = np.exp(-0.0175 * t)
        frames.append(
            pd.DataFrame(
                {
                    "case_id": case,
                    "t_s": t,
                    "semi_major_axis_error_km": 1.4 * dv0 * (1.0 - 0.02 * t) * shape,
                    "eccentricity_error": -2e-4 * dv0 * (1.0 - 0.021 * t) * shape,
                    "force_n": 1.75 * dv0 * shape * np.abs(2.0 - 0.0175 * t),
                    "position_error_m": dv0 * t * shape,
                }
            )
        )
    return pd.concat(frames, ignore_index=True)
