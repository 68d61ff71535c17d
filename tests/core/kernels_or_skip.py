"""The compiled kernels, for tests that need them."""

import os
from types import ModuleType

import pytest
from detp.core import compiled


def kernels_or_skip() -> ModuleType:
    """The kernels, compiled now if need be; skips the test where there are none."""
    pytest.importorskip("numba")
    if os.environ.get("DETP_COMPILED") == "off":
        pytest.skip("DETP_COMPILED=off")
    compiled.compile_now()
    found = compiled.kernels()
    assert found is not None
    return found
