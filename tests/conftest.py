"""How a run of the tests ends."""

import os
import sys

import pytest

ENDED = pytest.StashKey[int]()


def pytest_sessionfinish(session, exitstatus):
    session.config.stash[ENDED] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """End here: Blender as a module may hang or crash when Python ends, after all is done and said."""
    if "bpy" in sys.modules and ENDED in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[ENDED])
