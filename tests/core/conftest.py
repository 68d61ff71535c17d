"""Fixtures that tests of the core share."""

import pytest
from kernels_or_skip import kernels_or_skip


@pytest.fixture
def kernels():
    """The compiled kernels as a module; skips the test where there are none."""
    return kernels_or_skip()
