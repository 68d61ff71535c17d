"""Cells in which gather rays land, and where they are trusted."""

import numpy as np
from detp.core.gather.cells import Cells, CellTable, facings
from detp.core.gather.records import NEAR, Landings, Records
from detp.core.rays import RayCaster

CELLS = Cells(np.full(3, -1.0), 0.01)


def test_a_table_finds_what_was_put_in_and_nothing_else():
    generator = np.random.default_rng(1)
    numbers = np.unique(generator.integers(0, 1 << 62, 5000).astype(np.uint64))
    table = CellTable(numbers, np.arange(len(numbers)))
    assert np.array_equal(table.find(numbers), np.arange(len(numbers)))
    others = np.setdiff1d(generator.integers(0, 1 << 62, 5000).astype(np.uint64), numbers)
    assert (table.find(others) == -1).all()


def test_cells_are_as_wide_as_a_fifth_of_the_ray_but_no_smaller_than_the_finest():
    lengths = np.array([1e-6, 0.05, 0.2, 0.5, 1.9])
    sides = CELLS.sides(CELLS.levels(lengths))
    assert np.isclose(sides[0], CELLS.finest) and CELLS.finest >= 0.01
    long = lengths > 0.2
    assert ((sides <= 0.2 * lengths) & (sides > 0.1 * lengths))[long].all()


def test_sides_of_a_wall_and_sheets_behind_each_other_have_cells_of_their_own():
    places = np.array([(0.1, 0.1, 0.105), (0.1, 0.1, 0.105), (0.1, 0.1, 0.1085)])
    normals = np.array([(0, 0, 1.0), (0, 0, -1.0), (0, 0, 1.0)])
    numbers = CELLS.numbers(places, normals, CELLS.levels(np.full(3, 0.001)))
    assert len(np.unique(numbers)) == 3
    assert len(np.unique(facings(np.array([(1.0, 0, 0), (0.99, 0.1, 0.1)])))) == 1


def test_cells_that_a_wall_cuts_and_rays_that_are_too_short_are_not_looked_up():
    floor = [[(-1, -1, 0), (1, -1, 0), (1, 1, 0)], [(-1, -1, 0), (1, 1, 0), (-1, 1, 0)]]
    wall = [[(0.01, -1, 0), (0.01, 1, 0), (0.01, 1, 1)], [(0.01, -1, 0), (0.01, 1, 1), (0.01, -1, 1)]]
    caster = RayCaster(np.array(floor + wall, float))
    generator = np.random.default_rng(2)
    places = np.c_[generator.uniform(-0.5, 0.5, (20000, 2)), np.zeros(20000)]
    up, lengths = np.tile((0, 0, 1.0), (20000, 1)), np.full(20000, 0.5)
    landings = Landings(places, places + 1e-4 * up, up, lengths)
    records = Records(caster, landings, 1000, 0, 0.1)
    found = records.find(landings) >= 0
    assert not found[np.abs(places[:, 0] - 0.01) < 0.005].any()
    assert found[np.abs(places[:, 0] - 0.01) > 0.25].mean() > 0.99
    short = Landings(places, places, up, np.full(20000, 0.9 * NEAR * records.finest))
    assert (records.find(short) == -1).all()
