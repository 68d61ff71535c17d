"""Bakes stay right at the numerical extremes: every case of extreme_cases.py, small."""

import extent_cases  # noqa: F401 it adds its cases
import extreme_cases
import pytest


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("case", extreme_cases.CASES, ids=lambda case: case.run.__name__)
def test_extreme(case):
    measured, as_expected = case.run(1.0)
    assert as_expected, f"{case.name}: expected {case.expected}, measured {measured}"
