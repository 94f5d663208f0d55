"""Attitude control of a flexible satellite by a robust PID and pulse-modulated thrusters: MODEL is what files name."""

from campaigns.flexible_satellite.model import MODEL

__all__ = ["MODEL"]
