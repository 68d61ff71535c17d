"""Fixtures that tests of the core share."""

import pytest
from hypothesis import settings
from kernels_or_skip import kernels_or_skip

# How long an example takes says what else the machine does: speed is measured in benchmarks.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


@pytest.fixture
def kernels():
    """The compiled kernels as a module; skips the test where there are none."""
    return kernels_or_skip()
