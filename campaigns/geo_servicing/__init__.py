"""Servicing a geostationary satellite, phasing and inspection: `MODEL` is what a campaign file names."""

from campaigns.geo_servicing.model import MODEL

__all__ = ["MODEL"]
