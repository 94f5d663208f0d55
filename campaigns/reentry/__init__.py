"""Atmospheric entry, from steep ballistic to skip and aerobraking: `MODEL` is what a campaign file names."""

from campaigns.reentry.model import MODEL

__all__ = ["MODEL"]
