"""De-orbit trajectory correction by feedback linearization: `MODEL` is what a campaign file names."""

from campaigns.deorbit.model import MODEL

__all__ = ["MODEL"]
