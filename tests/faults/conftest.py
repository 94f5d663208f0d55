"""The run that several tests of damage begin with."""

import pytest
from stones import copy_of, flown_stones


@pytest.fixture(scope="session")
def flown(tmp_path_factory):
    """An unbroken run of 200 stones in five parts."""
    return flown_stones(tmp_path_factory.mktemp("stones"), 200, 40)


@pytest.fixture
def run(flown, tmp_path):
    """A copy of the run, to be damaged."""
    return copy_of(flown, tmp_path)
