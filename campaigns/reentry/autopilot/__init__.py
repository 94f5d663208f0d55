"""Attitude autopilot of an entering capsule, a model of its own: `MODEL` is what a campaign file names."""

from campaigns.reentry.autopilot.model import MODEL

__all__ = ["MODEL"]
