"""The parts of the gatherers against their definitions: octants, trees, frames, curves, streams."""

import threading

import numpy as np
import pytest
from detp.core import parallel
from detp.core.gatherers import gatherer as searching
from detp.core.gatherers.balanced_tree import BalancedTree
from detp.core.gatherers.disc_index import facing_octants, is_slanted, octants_of
from detp.core.gatherers.gatherer import Crossings
from detp.core.gatherers.local_frame import LocalFrame
from detp.core.ranges import blocks, expanded, expanded_blocks
from detp.core.space_filling import curve_order, morton_codes
from detp.core.study.fields import mean_spacing

LENGTHS = np.array([3, 0, 1, 7, 0, 2, 12])


def test_no_direction_of_an_octant_arrives_against_what_is_left_out_for_it():
    generator = np.random.default_rng(5)
    normals = generator.normal(size=(400, 3)) * 10.0 ** generator.uniform(-9, 0, (400, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    steps = (generator.normal(size=(400, 3)) * 10.0 ** generator.uniform(-9, 0, (400, 3))).astype(np.float32)
    slanted = is_slanted(steps.T)
    assert 50 < slanted.sum() < 350
    facing = steps.astype(float) @ normals.T
    seen = (facing_octants(normals)[None] >> octants_of(steps.T)[:, None] & 1 == 1) | ~slanted[:, None]
    assert (facing[~seen] > 0).all()


def test_a_balanced_tree_halves_what_it_holds():
    generator = np.random.default_rng(6)
    points, kind = generator.normal(size=(1000, 3)), generator.integers(0, 3, 1000) * 2
    tree = BalancedTree.over(points, kind, 8)
    assert np.array_equal(np.sort(tree.order), np.arange(1000))
    leaves = tree.leaves
    assert tree.count[leaves].max() <= 8
    assert np.array_equal(np.cumsum(tree.count[leaves]) - tree.count[leaves], tree.start[leaves])
    for node in np.flatnonzero(tree.child >= 0):
        children = tree.child[node] + np.arange(4)
        assert tree.count[children].sum() == tree.count[node]
        assert np.ptp(tree.count[children]) <= 1
        assert tree.start[children[0]] == tree.start[node]
    lowest = tree.bounds(points, np.minimum)
    for node in range(len(tree.start)):
        held = tree.order[tree.start[node] : tree.start[node] + tree.count[node]]
        assert np.array_equal(lowest[node], points[held].min(axis=0))
        assert len(set(kind[held])) == 1


def test_pieces_are_the_parts_of_segments_inside_the_frame():
    generator = np.random.default_rng(7)
    frame = LocalFrame(np.array([1.0, 2.0, 3.0]), 0.5, np.array([10.0, 20.0, 30.0]))
    origins, ends = generator.uniform(-10, 25, (2, 2000, 3))
    ends[:50, 0] = origins[:50, 0]
    pieces = frame.pieces(origins.T, ends.T)
    share = np.linspace(0, 1, 501)[:, None, None]
    path = frame.local(origins + share * (ends - origins))
    inside = ((path >= 0) & (path <= frame.size)).all(axis=2).any(axis=0)
    assert set(np.flatnonzero(inside)) <= set(pieces.segment)
    assert len(pieces.segment) < inside.sum() + 30
    begin, whole = (
        frame.local(origins[pieces.segment]),
        frame.local(ends[pieces.segment]) - frame.local(origins[pieces.segment]),
    )
    along = (whole * whole).sum(axis=1)
    for local in (pieces.start.T, (pieces.start + pieces.step).T):
        # Each end of a piece lies on its segment, at a face of the frame or an end of the segment.
        time = ((local - begin) * whole).sum(axis=1) / along
        assert np.abs(begin + time[:, None] * whole - local).max() < 1e-5
        assert (local > -1e-5).all() and (local < frame.size + 1e-5).all()
        at_face = np.minimum(np.abs(local), np.abs(frame.size - local)).min(axis=1) < 1e-5
        assert (at_face | (np.abs(time) < 1e-6) | (np.abs(time - 1) < 1e-6)).all()


def test_ranges_are_laid_out_and_cut():
    start = np.array([5, 0, 100, 20, 3, 50, 200])
    row, place = expanded(start, LENGTHS)
    assert row.tolist() == [0, 0, 0, 2, 3, 3, 3, 3, 3, 3, 3, 5, 5, *[6] * 12]
    assert place.tolist() == [5, 6, 7, 100, *range(20, 27), 50, 51, *range(200, 212)]
    for limit in (1, 4, 5, 100):
        parts = list(expanded_blocks(start, LENGTHS, limit))
        assert max(len(part) for part, _ in parts) <= limit
        assert np.array_equal(np.concatenate([part for part, _ in parts]), row)
        assert np.array_equal(np.concatenate([part for _, part in parts]), place)
    assert list(expanded_blocks(start[:0], LENGTHS[:0], 5)) == []
    assert [(part.start, part.stop) for part in blocks(LENGTHS, 8)] == [(0, 3), (3, 5), (5, 6), (6, 7)]


def test_the_morton_curve_interleaves_the_bits_of_the_coordinates():
    corners = np.array([[0, 0, 0], [2**21 - 1] * 3], float)
    points = np.concatenate([corners, np.random.default_rng(8).integers(0, 2**21, (50, 3)).astype(float)])
    for point, code in zip(points, morton_codes(points), strict=True):
        digits = [f"{int(x):021b}" for x in point]
        assert int(code) == int("".join(digits[2][bit] + digits[1][bit] + digits[0][bit] for bit in range(21)), 2)
    order = curve_order(points)
    assert (np.diff(morton_codes(points)[order].astype(float)) >= 0).all()
    assert morton_codes(points[:0]).tolist() == [] and morton_codes(points[:1]).tolist() == [0]
    assert curve_order(np.ones((5, 3))).tolist() == [0, 1, 2, 3, 4]


def test_the_mean_spacing_of_points_on_surfaces():
    generator = np.random.default_rng(9)
    ball = generator.normal(size=(20_000, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    square = generator.uniform(0, 3, (5000, 3)) * [1, 1, 0]
    for points, spacing in ((ball, np.sqrt(4 * np.pi / 20_000)), (square + 1e6, np.sqrt(9 / 5000))):
        assert mean_spacing(points) == pytest.approx(spacing, rel=0.2)
        assert mean_spacing(np.repeat(points, 3, axis=0)) == pytest.approx(mean_spacing(points))
    assert mean_spacing(np.ones((4, 3))) == mean_spacing(np.ones((0, 3))) == 0.0


def test_streams_take_turns_whatever_the_number_of_threads(monkeypatch):
    def stream(name, length):
        for number in range(length):
            yield f"{name}{number}"

    before = set(threading.enumerate())  # those of whoever runs the tests
    for threads in (1, 2, 3):
        monkeypatch.setattr(parallel, "worker_count", lambda threads=threads: threads)
        got = []
        for item in parallel.interleaved(stream(name, length) for name, length in (("a", 3), ("b", 1), ("c", 2))):
            got.append(item)
            assert set(threading.enumerate()) <= before
        assert got == ["a0", "b0", "c0", "a1", "c1", "a2"]


def test_portions_are_full_but_bounded_and_end_even_when_empty(monkeypatch):
    monkeypatch.setattr(searching, "PAIRS", 10)
    found = [Crossings(np.arange(count), np.arange(count)) for count in (4, 5, 3, 0, 0, 0, 12, 1)]
    assert [len(portion) for portion in searching.portions(found, 3)] == [9, 3, 0, 12, 1]
    assert [len(portion) for portion in searching.portions([], 3)] == [0]


def test_lanes_search_every_row_once():
    def search(rows):
        yield Crossings(np.arange(rows.start, rows.stop), np.zeros(rows.stop - rows.start, np.int64))

    for count in (0, 1, 99, 100, 1000, 12345):
        found = list(searching.in_lanes(count, 100, search))
        assert np.array_equal(
            np.sort(np.concatenate([np.zeros(0, int), *[c.segment for c in found]])), np.arange(count)
        )
        assert all(len(chunk) <= 100 for chunk in found)
