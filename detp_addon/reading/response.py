"""What a surface does to light, in a form that can be mixed, added and averaged."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True)
class Response:
    """What a shader does to light at m places or everywhere alike: (m or 1, 3), RGB, or (m or 1, 1) each.

    albedo         share reflected diffusely
    emission       radiance given off, W/(m^2 sr)
    transmittance  share that goes straight on
    mirror         share reflected as by a metal
    gloss          share that the boundary of a clear body handles, in the tint of what it reflects
    clear          the same share, in the tint of what it lets in or out
    blur           roughness of what mirrors or refracts, times its share
    bend           index of refraction, times the share of the clear boundary
    spread         share that comes out evenly on the other side
    highlight      share that highlights above the diffuse part reflect, and it alone does not

    All of them add up where responses do.
    """

    albedo: np.ndarray
    emission: np.ndarray
    transmittance: np.ndarray
    mirror: np.ndarray
    gloss: np.ndarray
    clear: np.ndarray
    blur: np.ndarray
    bend: np.ndarray
    spread: np.ndarray
    highlight: np.ndarray

    @classmethod
    def of(
        cls,
        albedo=0.0,
        emission=0.0,
        transmittance=0.0,
        mirror=0.0,
        gloss=0.0,
        clear=0.0,
        roughness=0.0,
        ior=1.0,
        spread=0.0,
        highlight=0.0,
    ) -> Response:
        """A response from arrays (m, 3 or 1) or single numbers."""
        *colours, spread, highlight = (
            np.atleast_2d(v) * np.ones((1, 3))
            for v in (albedo, emission, transmittance, mirror, gloss, clear, spread, highlight)
        )
        glass = _glass(*colours[4:])
        blur = roughness * (colours[3].mean(axis=1, keepdims=True) + glass)
        return cls(*colours, blur, ior * glass, spread, highlight)

    @classmethod
    def none(cls, count: int) -> Response:
        """The response of ``count`` black places, whose arrays can be written to."""
        return cls(*(np.zeros((count, 1 if field.name in ("blur", "bend") else 3)) for field in fields(cls)))

    @property
    def colour(self) -> np.ndarray:
        """The share (m, 3) reflected diffusely or as by a metal, in whose colour it is shown."""
        return self.albedo + self.mirror

    @property
    def even(self) -> np.ndarray:
        """The share (m, 3) that counts as reflected evenly: diffusely, and by highlights above that."""
        return self.albedo + self.highlight

    @property
    def roughness(self) -> np.ndarray:
        """Blender's roughness (m, 1) of what mirrors or refracts, 0 without any."""
        return _ratio(self.blur, self.mirror.mean(axis=1, keepdims=True) + _glass(self.gloss, self.clear), 0.0)

    @property
    def ior(self) -> np.ndarray:
        """Index of refraction (m, 1), 1 where nothing refracts."""
        return _ratio(self.bend, _glass(self.gloss, self.clear), 1.0)

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """All fields in their order."""
        return tuple(getattr(self, field.name) for field in fields(self))

    def rows(self, rows) -> Response:
        """The response at some places, by a slice or their numbers."""
        return self.each(lambda array: array[rows])

    def put(self, rows, other: Response) -> None:
        """Write what ``other`` does into the places ``rows``."""
        for array, values in zip(self.arrays, other.arrays, strict=True):
            array[rows] = values

    def scaled(self, share: np.ndarray) -> Response:
        """This response by a ``share`` (m or 1, 1) of the surface."""
        return Response(*(array * share for array in self.arrays))

    def plus(self, other: Response) -> Response:
        """Both responses together."""
        return Response(*(mine + theirs for mine, theirs in zip(self.arrays, other.arrays, strict=True)))

    def each(self, change) -> Response:
        """The response with every array replaced by ``change(array)``."""
        return Response(*map(change, self.arrays))

    @staticmethod
    def joined(parts: list[Response]) -> Response:
        """All places of ``parts`` in their order; ``parts`` holds at least one."""
        return Response(*(np.concatenate(arrays) for arrays in zip(*(part.arrays for part in parts), strict=True)))


@dataclass(frozen=True)
class Optics:
    """What T triangles do to light in each of VIEWS (views.py).

    Between surfaces, and from the world, light meets the first two, of fronts and of backs; on its way from lamps and
    what shines the next two let it pass; and the last two shine.

    front  T rows, of the first view
    rows   (R,) the triangles that are not the same in all views, ascending
    views  R rows, in each of VIEWS; none when there are no such triangles
    uneven material by material, its name and the triangles whose means hide a pattern
    """

    front: Response
    rows: np.ndarray
    views: tuple[Response, ...]
    uneven: tuple[tuple[str, np.ndarray], ...] = ()

    def seen(self, name: str, number: int) -> np.ndarray:
        """The array ``name`` of the response (T rows) in the view of that ``number``."""
        values = getattr(self.front, name)
        if number > 0 and len(self.rows):
            values = values.copy()
            values[self.rows] = getattr(self.views[number], name)
        return values

    @property
    def emission(self) -> np.ndarray:
        """Radiance (T, 3) that fronts give off, W/(m^2 sr)."""
        return self.seen("emission", 4)

    @property
    def shines(self) -> np.ndarray:
        """Whether (T,) any side gives light off."""
        return (self.emission != 0).any(axis=1) | (self.seen("emission", 5) != 0).any(axis=1)


def _glass(gloss: np.ndarray, clear: np.ndarray) -> np.ndarray:
    """How much (m, 1) of the surface is a clear boundary, whatever its tints."""
    return 0.5 * (gloss + clear).mean(axis=1, keepdims=True)


def _ratio(part: np.ndarray, whole: np.ndarray, otherwise: float) -> np.ndarray:
    part, whole = np.broadcast_arrays(part, whole)
    return np.where(whole > 0, part / np.where(whole > 0, whole, 1.0), otherwise)
