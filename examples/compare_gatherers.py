"""Both gatherers of the study on a mesh of your own: the same light, in how many seconds each, and a picture.

    python examples/compare_gatherers.py [MESH.obj] [-o PICTURE.png]

Without a mesh it makes a bumpy floor. Needs `pip install . matplotlib`, and no Blender.
"""

import argparse
import time
from itertools import pairwise

import numpy as np
from detp.core import BakeSettings, PointLight, Points, Scene, baked


def bumpy_floor(across: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (T, 3) of a floor of 2 m with waves, and a wall behind it."""
    u, v = np.meshgrid(np.linspace(-1, 1, across), np.linspace(-1, 1, across))
    floor = np.stack([u, v, 0.1 * np.sin(6 * u) * np.cos(5 * v)], axis=-1).reshape(-1, 3)
    corner = (np.arange(across - 1)[:, None] * across + np.arange(across - 1)).ravel()
    triangles = [(0, 1, across + 1), (0, across + 1, across)]
    wall = np.array([(-1, 1, -0.2), (1, 1, -0.2), (1, 1, 1), (-1, 1, 1)], float)
    behind = len(floor) + np.array([(0, 1, 2), (0, 2, 3)])
    return np.concatenate([floor, wall]), np.concatenate([*(corner[:, None] + t for t in triangles), behind])


def from_obj(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (T, 3) of a Wavefront file, whose polygons are cut into fans."""
    vertices, triangles = [], []
    with open(path, encoding="utf-8") as lines:
        for kind, *values in filter(None, map(str.split, lines)):
            if kind == "v":
                vertices.append([float(value) for value in values[:3]])
            elif kind == "f":
                face = [int(value.split("/")[0]) for value in values]
                face = [i - 1 if i > 0 else len(vertices) + i for i in face]
                triangles += [(face[0], *pair) for pair in pairwise(face[1:])]
    return np.array(vertices), np.array(triangles)


def main() -> None:
    """Bake, compare, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh", nargs="?")
    parser.add_argument("-o", "--output", default="gatherers.png")
    arguments = parser.parse_args()
    vertices, triangles = from_obj(arguments.mesh) if arguments.mesh else bumpy_floor()
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    real = np.linalg.norm(normals, axis=1) > 0
    corners, triangles, normals = corners[real], triangles[real], normals[real]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    lamp = PointLight((low + high) / 2 + (0, 0, (high - low).max()), np.full(3, 20 * (high - low).max() ** 2))
    scene = Scene(vertices, triangles, np.full((len(triangles), 3), 0.7), lights=(lamp,))
    points = Points(corners.mean(axis=1), normals)
    found = {}
    for gatherer in ("disc-index", "sphere-cache"):
        start = time.perf_counter()
        settings = BakeSettings(photons=200_000, gatherer=gatherer, indirect="photons")
        found[gatherer] = baked(scene, points, settings).irradiance
        print(f"{gatherer}: {time.perf_counter() - start:.1f} s, on average {found[gatherer].mean():.3f} W/m2")
    one, other = found.values()
    print(f"They differ by {np.abs(one - other).max() / one.max():.1e} of the brightest at most.")
    draw(corners, one, arguments.output)


def draw(corners: np.ndarray, irradiance: np.ndarray, path: str) -> None:
    """The triangles ``corners`` (T, 3, 3) in the colours of their ``irradiance`` (T, 3), as a picture at ``path``."""
    import matplotlib.pyplot as plt
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    colours = np.clip(irradiance / np.quantile(irradiance, 0.99), 0, 1) ** (1 / 2.2)
    axes = plt.figure(figsize=(6, 4)).add_axes((0, 0, 1, 1), projection="3d")
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colours))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.view_init(30, -70)
    axes.set_box_aspect(high - low + 1e-9, zoom=1.1)
    axes.set_axis_off()
    plt.savefig(path, dpi=120)
    print(f"Saved {path}")


if __name__ == "__main__":
    main()
