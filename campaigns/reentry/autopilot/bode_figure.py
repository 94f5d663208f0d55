"""Bode diagram of the autopilot's pitch loop: `python -m campaigns.reentry.autopilot.bode_figure bode.png`."""

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from campaigns.reentry.autopilot.lead_compensator import Compensator, Response
from campaigns.reentry.autopilot.model import MODEL, pitch_design


def bode_figure(loops: dict[str, tuple[Response, float, Compensator]]) -> Any:
    """Figure of gain and phase [deg] of open loops over the frequency [rad/s]: dashed without, solid with compensation.

    loops : by legend text, (plant, gain, compensator)
    """
    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    w = np.geomspace(0.05, 200.0, 1200)
    for colour, (text, (plant, gain, lead)) in enumerate(loops.items()):
        margins = lead.margins(plant)
        legend = f"{text}: {np.degrees(margins.phase):.1f}° at {margins.crossover:.2f} rad/s"
        for loop, style, label in ((gain * plant(w), "--", None), (lead.response(w) * plant(w), "-", legend)):
            upper.loglog(w, np.abs(loop), style, color=f"C{colour}", label=label)
            phase = np.degrees(np.angle(loop))
            # a quarter of a turn of lead at most: what is above it has lagged by the rest of a turn
            lower.semilogx(w, np.where(phase > 90.0, phase - 360.0, phase), style, color=f"C{colour}")
        lower.plot(margins.crossover, np.degrees(margins.phase) - 180.0, "o", color=f"C{colour}")
    upper.axhline(1.0, color="0.5", linewidth=0.8)
    lower.axhline(-180.0, color="0.5", linewidth=0.8)
    upper.set_ylabel("gain of the open loop")
    lower.set_ylabel("phase, degrees")
    lower.set_xlabel("frequency, rad/s")
    upper.legend(title="phase margin at crossover, compensated (solid)")
    return figure


if __name__ == "__main__":
    o = SimpleNamespace(**{setting.symbol: setting.code(setting.default) for setting in MODEL.settings})
    loops = {f"{pressure / 1e3:g} kPa": pitch_design(o, pressure) for pressure in (0.0, 4e3, 12e3)}
    bode_figure(loops).savefig(sys.argv[1], dpi=120)
