"""Attitude autopilot of an entering capsule, a model of its own: `MODEL` is what a campaign file names.

`gains` designs the loops with `lead_compensator`, `model` flies them, `bode_figure` draws them.
"""

from campaigns.reentry.autopilot.model import MODEL

__all__ = ["MODEL"]
