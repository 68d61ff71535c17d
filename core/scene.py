"""The scene model: what photons meet (triangles) and where they come from (lights)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .bounds import Bounds
from .checks import fill, float_rows, index_rows
from .errors import InvalidArrayError, NoMeshError
from .lights.light import Light
from .photons.specular import Specular
from .sides import sided_rows


@dataclass(frozen=True)
class Scene:
    """Triangles and lights; surfaces are Lambertian reflectors and emitters on both sides, and may also be specular.

    What differs by the side that light or a ray meets has the shape (2, T, 3) instead of (T, 3): front, back.

    vertices       (V, 3) positions in metres
    triangles      (T, 3) vertex indices
    albedo         (T, 3) diffusely reflected share of the light, RGB, 0..1
    emission       (T, 3) emitted radiance in W/(m^2 sr), RGB, from each of the two sides; None: none
    transmittance  (T, 3) share that goes straight on through the surface, RGB, 0..1 (alpha, thin glass), by the side
                   that who receives the light sees; None: none
    lights         lamps and the world; emissive triangles are not repeated here
    specular       the triangles that also mirror or refract light, None when the scene has none
    translucency   (T, 3) share that comes out evenly spread on the other side, RGB, 0..1, by the side that who receives
                   the light sees; None: nothing does
    unshaded       (T, 3) ``transmittance`` for light on its straight way from lamps and shining triangles, where it is
                   another than for light from the world and from surfaces; None: the same

    Raises InvalidArrayError on shapes, indices or values that are not as above, NoMeshError without
    triangles.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    albedo: np.ndarray
    emission: np.ndarray | None = None
    transmittance: np.ndarray | None = None
    lights: tuple[Light, ...] = field(default=())
    specular: Specular | None = None
    unshaded: np.ndarray | None = None
    translucency: np.ndarray | None = None

    def __post_init__(self):
        vertices = float_rows(self.vertices, "vertices")
        triangles = index_rows(self.triangles, "triangles", 3, len(vertices))
        count = len(triangles)
        if count == 0:
            raise NoMeshError("The scene has no faces, so there is nothing to bake: add a mesh that a render shows.")
        checked = {"vertices": vertices, "triangles": triangles, "lights": tuple(self.lights)}
        for name in ("albedo", "emission", "transmittance"):
            given = getattr(self, name)
            checked[name] = sided_rows(np.zeros((count, 3)) if given is None else given, name, count)
        if self.specular is not None and len(self.specular.triangles) and self.specular.triangles[-1] >= count:
            raise InvalidArrayError(f"specular triangles must be rows of the {count} triangles.")
        for name in ("unshaded", "translucency"):
            if getattr(self, name) is not None:
                checked[name] = sided_rows(getattr(self, name), name, count)
        for name in {"albedo", "transmittance", "unshaded", "translucency"} & set(checked):
            if (checked[name] < 0).any():
                raise InvalidArrayError(f"{name} must not be negative.")
        fill(self, **checked)

    @property
    def bounds(self) -> Bounds:
        """The box around the triangles (vertices that no triangle uses do not count)."""
        used = np.zeros(len(self.vertices), bool)
        used[self.triangles] = True
        return Bounds.of(self.vertices if used.all() else self.vertices[used])

    @property
    def corners(self) -> np.ndarray:
        """Triangle corner positions (T, 3 corners, 3) in metres."""
        return self.vertices[self.triangles]
