"""Settings for all tests: the same examples on every machine, and no clock on a single one."""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")
