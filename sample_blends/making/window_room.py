"""A living room that the sun and the sky light through one window."""

from __future__ import annotations

import numpy as np

from . import stage
from .regions import circle, rectangle, region
from .surfaces import Surface, box, frame, lathe, net, quad, steps

CELL = 0.12
#: the room's size, the window's extent along y and z in the wall x = 0, and the walls' thickness, in metres
ROOM, WINDOW, THICKNESS = (4.6, 5.2, 2.7), ((1.9, 4.1), (0.8, 2.3)), 0.3

RUG = rectangle(1.05, 1.75, 3.05, 3.75)
TABLE_LEGS = [(x, y) for x in (1.55, 2.45) for y in (2.35, 3.05)]


def upright(flat: Surface) -> Surface:
    """A flat piece (y, z) of the ground plane as a piece of the wall x = 0, facing +x."""
    return Surface(flat.vertices[:, [2, 0, 1]], flat.faces)


def window_wall() -> tuple[Surface, Surface, Surface]:
    """The wall with the opening: inside, reveal and outside."""
    (y0, y1), (z0, z1) = WINDOW
    opening = rectangle(y0, z0, y1, z1)
    inside = upright(region(rectangle(0.0, 0.0, *ROOM[1:]), [opening], CELL))
    # The middle of the opening is the frame's origin, so it is built lying down and raised afterwards.
    half_y, half_z = 0.5 * (y1 - y0), 0.5 * (z1 - z0)
    lying = frame(half_y, half_z, [(0.0, 0.0), (0.0, -0.5 * THICKNESS), (0.0, -THICKNESS)], CELL)
    reveal = upright(lying).moved(0.0, y0 + half_y, z0 + half_z)
    outer = rectangle(-THICKNESS, -THICKNESS, ROOM[1] + THICKNESS, ROOM[2] + THICKNESS)
    outside = upright(region(outer, [opening], 1.2))
    return inside, reveal, outside.flipped().moved(x=-THICKNESS)


def casement() -> list[Surface]:
    """The window's frame with a mullion and a transom."""
    (y0, y1), (z0, z1) = WINDOW
    x0, x1, width = -0.20, -0.14, 0.06
    middle, transom = 0.5 * (y0 + y1), z1 - 0.45
    return [
        box((x0, y0, z0), (x1, y1, z0 + width), CELL, without="-z -y +y"),
        box((x0, y0, z1 - width), (x1, y1, z1), CELL, without="+z -y +y"),
        box((x0, y0, z0 + width), (x1, y0 + width, z1 - width), CELL, without="-y -z +z"),
        box((x0, y1 - width, z0 + width), (x1, y1, z1 - width), CELL, without="+y -z +z"),
        box((x0, middle - 0.03, z0 + width), (x1, middle + 0.03, z1 - width), CELL, without="-z +z"),
        box((x0 + 0.005, y0 + width, transom), (x1 - 0.005, middle - 0.03, transom + 0.045), CELL, without="-y +y"),
        box((x0 + 0.005, middle + 0.03, transom), (x1 - 0.005, y1 - width, transom + 0.045), CELL, without="-y +y"),
    ]


def sofa() -> tuple[list[Surface], list[Surface], np.ndarray]:
    """A sofa with its back to the wall y = ROOM[1]: body, cushions and footprint."""
    x0, x1, y0, y1 = 1.35, 3.55, 4.20, 5.12
    body = [
        box((x0 + 0.2, y0, 0.0), (x1 - 0.2, y1 - 0.22, 0.26), 0.1, without="-z +z -x +x +y"),
        box((x0, y0, 0.0), (x0 + 0.2, y1, 0.60), 0.1, without="-z"),
        box((x1 - 0.2, y0, 0.0), (x1, y1, 0.60), 0.1, without="-z"),
        box((x0 + 0.2, y1 - 0.22, 0.0), (x1 - 0.2, y1, 0.82), 0.1, without="-z"),
    ]
    cushions = []
    for start in (x0 + 0.2, x0 + 1.1):
        cushions.append(box((start + 0.005, y0 - 0.02, 0.26), (start + 0.895, y1 - 0.225, 0.44), 0.09))
        back = box((0.02, -0.16, 0.0), (0.88, 0.0, 0.42), 0.09, without="-z").turned(-9.0, "x")
        cushions.append(back.moved(start, y1 - 0.29, 0.445))
    return body, cushions, rectangle(x0, y0, x1, y1)


def shelf(random) -> tuple[list[Surface], list[Surface], np.ndarray]:
    """A bookshelf against the wall y = ROOM[1] beside the window: boards, books and footprint."""
    x0, x1, y0, y1, height, board = 0.30, 1.10, 4.88, 5.18, 1.95, 0.025
    boards = [
        box((x0, y0, 0.0), (x0 + board, y1, height), 0.1, without="-z"),
        box((x1 - board, y0, 0.0), (x1, y1, height), 0.1, without="-z"),
        quad([(x0, y1, 0), (x1, y1, 0), (x1, y1, height), (x0, y1, height)], 0.1),
    ]
    a, b = x0 + board, x1 - board
    boards.append(quad([(a, y0, 0.0), (b, y0, 0.0), (b, y0, 0.08), (a, y0, 0.08)], 0.1))
    books = []
    for level in np.linspace(0.08, height - board, 6):
        boards.append(box((x0 + board, y0 + 0.005, level), (x1 - board, y1, level + board), 0.1, without="-x +x +y"))
        x = x0 + board + 0.02
        while level < height - 0.3 and x < x1 - 0.22:
            width, tall, deep = random.uniform((0.022, 0.20, 0.15), (0.05, 0.30, 0.22))
            book = box((x, y1 - deep - 0.03, level + board), (x + width, y1 - 0.03, level + board + tall), 0.1, "-z +y")
            books.append(book.of(int(random.integers(4))))
            x += width + 0.002 + 0.07 * (random.random() < 0.12)
    return boards, books, rectangle(x0, y0, x1, y1)


def rug() -> list[Surface]:
    """A rug on the floor around the table's legs, with its edge."""
    legs = [rectangle(x - 0.025, y - 0.025, x + 0.025, y + 0.025) for x, y in TABLE_LEGS]
    half_x, half_y = 0.5 * (RUG[2] - RUG[0])
    edge = frame(half_x, half_y, [(0.0, 0.0), (0.0, 0.012)], 0.1).moved(*(RUG[0] + (half_x, half_y)))
    return [region(RUG, legs, 0.1).moved(z=0.012), edge]


def coffee_table() -> list[Surface]:
    """A low table on the rug."""
    top = box((1.42, 2.22, 0.36), (2.58, 3.18, 0.40), 0.08)
    legs = [
        box((x - 0.025, y - 0.025, 0.012), (x + 0.025, y + 0.025, 0.36), 0.12, without="-z +z") for x, y in TABLE_LEGS
    ]
    return [top, *legs]


def plant(random) -> list[Surface]:
    """A pot with long arching leaves, around the z axis."""
    clay = [(0.13, 0.0), (0.16, 0.15), (0.19, 0.34), (0.20, 0.36), (0.175, 0.36), (0.17, 0.31), (0.005, 0.31)]
    parts = [lathe(clay, 20).of(0, smooth=True)]
    for number in range(17):
        length, droop = random.uniform(0.5, 0.85), random.uniform(0.25, 0.9)
        along = steps(0.0, 1.0, 0.125)
        out = length * (0.12 + 0.6 * droop * along) * along
        up = length * (1.25 * along - droop * along**2)
        half = 0.055 * np.sin(np.pi * (0.06 + 0.93 * along)) ** 0.8
        blade = np.stack([[out, side * half, up + 0.25 * abs(side) * half] for side in (1.0, 0.0, -1.0)])
        blade = blade.transpose(0, 2, 1)
        turn = 137.5 * number + random.uniform(-12, 12)
        parts.append(net(blade).of(1, smooth=True).moved(x=0.03, z=0.31).turned(turn))
    return parts


def curtain() -> Surface:
    """A curtain in folds, hanging along y from z = 0, facing +x."""
    y, z = np.meshgrid(steps(0.0, 0.42, 0.021), steps(-2.35, 0.0, 0.13), indexing="ij")
    fold = 0.035 * np.sin(2 * np.pi * y / 0.14) * (0.75 - 0.1 * z)
    return net(np.stack([fold, y, z], axis=-1)).of(smooth=True)


def pictures() -> list[Surface]:
    """Two pictures on the wall y = ROOM[1]: frames and what is in them."""
    parts = []
    for slot, (x, z, half_x, half_z) in enumerate([(2.15, 1.65, 0.36, 0.27), (2.98, 1.62, 0.22, 0.30)], start=1):
        y = ROOM[1]
        border = [(0.035, -0.005), (0.035, 0.03), (0.0, 0.03), (0.0, 0.012)]
        parts.append(frame(half_x, half_z, border, 0.1).turned(90.0, "x").moved(x, y, z))
        corners = [(x - half_x, y - 0.012, z - half_z), (x + half_x, y - 0.012, z - half_z)]
        corners += [(x + half_x, y - 0.012, z + half_z), (x - half_x, y - 0.012, z + half_z)]
        parts.append(quad(corners, 0.1).of(slot))
    return parts


def shell(sofa_foot: np.ndarray, shelf_foot: np.ndarray, pot_foot: np.ndarray) -> None:
    """Floor, ceiling and walls, without what furniture covers of the floor."""
    x, y, z = ROOM
    white = stage.material("White paint", (0.80, 0.79, 0.76))
    floor = region(rectangle(0, 0, x, y), [RUG, sofa_foot, shelf_foot, pot_foot], CELL)
    stage.add("Floor", [floor], [stage.material("Oak", (0.42, 0.27, 0.15))])
    ceiling = quad([(0, y, z), (x, y, z), (x, 0, z), (0, 0, z)], CELL)
    stage.add("Ceiling", [ceiling], [white])
    inside, reveal, outside = window_wall()
    stage.add("Window wall", [inside, reveal], [white])
    # Walls have a thickness all around: with bare sheets the outdoors would begin within the inner edges' discs.
    t = THICKNESS
    others = box((-t, -t, -t), (x + t, y + t, z + t), 2.0, without="-x")
    stage.add("Outside", [outside, others], [stage.material("Render", (0.6, 0.6, 0.6))])
    stage.add("Casement", casement(), [white])
    end = quad([(0, y, 0), (x, y, 0), (x, y, z), (0, y, z)], CELL)
    stage.add("End wall", [end], [stage.material("Teal paint", (0.12, 0.36, 0.38))])
    side = quad([(x, y, 0), (x, 0, 0), (x, 0, z), (x, y, z)], CELL)
    stage.add("Side wall", [side], [stage.material("Ochre paint", (0.70, 0.42, 0.14))])
    near = quad([(x, 0, 0), (0, 0, 0), (0, 0, z), (x, 0, z)], CELL)
    stage.add("Near wall", [near], [white])


def build() -> None:
    """Fill an empty file with the room."""
    stage.empty_file(960, 600)
    random = np.random.default_rng(88)
    body, cushions, sofa_foot = sofa()
    boards, books, shelf_foot = shelf(random)
    shell(sofa_foot, shelf_foot, circle(0.13, 20, 4.1, 4.72))
    linen = stage.material("Linen", (0.62, 0.58, 0.50))
    grey = stage.material("Grey cloth", (0.35, 0.36, 0.38))
    stage.add("Sofa", [*body, *(part.of(1) for part in cushions)], [grey, linen])
    walnut = stage.material("Walnut", (0.26, 0.15, 0.08))
    covers = [(0.55, 0.10, 0.07), (0.10, 0.20, 0.42), (0.70, 0.55, 0.20), (0.14, 0.32, 0.16)]
    stage.add("Shelf", boards, [walnut])
    stage.add("Books", books, [stage.material(f"Book {n}", colour) for n, colour in enumerate(covers, 1)])
    stage.add("Rug", rug(), [stage.material("Red wool", (0.58, 0.09, 0.06))])
    stage.add("Coffee table", coffee_table(), [walnut])
    glaze, leaf = stage.material("Glaze", (0.75, 0.74, 0.70)), stage.material("Leaf", (0.10, 0.30, 0.07))
    pot = stage.add("Plant", plant(random), [glaze, leaf])
    pot.location = (4.1, 4.72, 0.0)
    hanging = [curtain().moved(0.09, y, 2.5) for y in (WINDOW[0][0] - 0.42, WINDOW[0][1])]
    stage.add("Curtains", hanging, [linen])
    paintings = [stage.material("Painting 1", (0.75, 0.60, 0.25)), stage.material("Painting 2", (0.20, 0.34, 0.55))]
    stage.add("Pictures", pictures(), [walnut, *paintings])
    stage.sun(9.0, 36.0, 168.0, (1.0, 0.90, 0.74), 0.6)
    stage.sky((0.66, 0.81, 1.0), 7.0)
    stage.camera((4.35, 0.25, 1.45), (1.55, 4.2, 1.05), 19.0)
