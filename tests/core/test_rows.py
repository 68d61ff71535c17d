"""Rows of dataclasses of arrays: what is taken and joined is the same to the bit, whatever is in a field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from detp.core.discs import TangentDiscs
from detp.core.group_sums import group_sums
from detp.core.rows import Rows


@dataclass(frozen=True)
class Pairs(Rows):
    number: np.ndarray
    discs: TangentDiscs
    colour: np.ndarray | None = None


def pairs(count, seed, coloured=True):
    generator = np.random.default_rng(seed)
    discs = TangentDiscs(*generator.normal(size=(2, count, 3)), generator.uniform(1, 2, count))
    return Pairs(np.arange(count), discs, generator.random((count, 3)) if coloured else None)


def same(one, other):
    return all(
        np.array_equal(getattr(one.discs, name), getattr(other.discs, name)) for name in ("centres", "normals", "radii")
    ) and np.array_equal(one.number, other.number)


@pytest.mark.parametrize("rows", [np.array([4, 0, 4]), slice(1, 4), np.arange(6) % 2 == 0, np.zeros(0, np.int64)])
def test_rows_are_taken_from_all_fields(rows):
    whole = pairs(6, 1)
    some = whole.taken(rows)
    assert len(some) == len(some.discs) == len(np.arange(6)[rows])
    assert np.array_equal(some.number, whole.number[rows]) and np.array_equal(some.colour, whole.colour[rows])
    assert np.array_equal(some.discs.normals, whole.discs.normals[rows])
    assert pairs(6, 1, coloured=False).taken(rows).colour is None


def test_parts_are_joined_in_their_order_without_what_one_of_them_lacks():
    whole = pairs(9, 2)
    parts = [whole.taken(slice(0, 2)), whole.taken(slice(2, 2)), whole.taken(slice(2, 9))]
    joined = Pairs.joined(parts)
    assert same(joined, whole) and np.array_equal(joined.colour, whole.colour)
    assert Pairs.joined([parts[0]]) is parts[0]
    assert Pairs.joined([whole, pairs(3, 3, coloured=False)]).colour is None


def test_sums_of_no_rows_are_numbers_to_which_light_can_be_added():
    sums = group_sums(np.empty((0, 3)), np.empty(0, np.int64), 2)
    sums += 0.5
    np.testing.assert_array_equal(sums, np.full((2, 3), 0.5))
