"""The shipped campaigns: one folder a published system."""
