"""Injection into the geostationary circle by an upper stage: `MODEL` is what a campaign file names."""

from campaigns.geo_injection.model import MODEL

__all__ = ["MODEL"]
