"""Settings that tests of the core share."""

from hypothesis import settings

# How long an example takes says what else the machine does: speed is measured in benchmarks.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")
