"""Environment world: radiance from a picture of all directions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from ..bounds import Bounds
from ..checks import fill, float_rows
from ..errors import InvalidArrayError
from ..sampling import choose, face_points
from .light import Particles, ShadowRays, Sky


@dataclass(frozen=True, eq=False)
class EnvironmentWorld(Sky):
    """A sky whose radiance is constant over each pixel of an equirectangular picture in Blender's convention.

    radiance  (H, W, 3) in W/(m^2 sr), RGB. Row 0 is the bottom, as in Blender's ``Image.pixels``. Pixel (row, column)
              is what one sees looking from the scene towards latitude pi ((row + 1/2) / H - 1/2) above the horizon and
              azimuth 2 pi (1/2 - (column + 1/2) / W) counted from +X towards +Y. So the middle column looks along +X,
              a quarter of the width along +Y, three quarters along -Y, the two side edges along -X, the first row
              down and the last one up.

    Light travels against that. Raises InvalidArrayError on other shapes or non-finite values. Needs 56 bytes a pixel:
    scale pictures beyond some thousand pixels a side down first.

    Attribute ``strength_sums`` (H * W,): the running sum of the pixels' strongest channels times their solid angles.

    Flux enters the box through faces perpendicular to x, y and z; the flux through a unit face from one pixel is its
    radiance times the integral of |w_x|, |w_y| or |w_z| over it, which the rows and columns factor into closed form.
    """

    radiance: np.ndarray
    aimed: ClassVar[bool] = True
    _row_factors: np.ndarray = field(init=False, repr=False)
    _column_factors: np.ndarray = field(init=False, repr=False)
    _shares: np.ndarray = field(init=False, repr=False)
    _through: np.ndarray = field(init=False, repr=False)
    strength_sums: np.ndarray = field(init=False, repr=False)

    def __post_init__(self):
        shape = np.shape(self.radiance)
        if len(shape) != 3 or shape[2] != 3 or 0 in shape:
            raise InvalidArrayError(f"The environment picture must have the shape (rows, columns, 3), not {shape}.")
        radiance = float_rows(np.reshape(self.radiance, (-1, 3)), "environment pixels").reshape(shape)
        rows, columns = _factors(shape[0], shape[1])
        strength = np.abs(radiance).max(axis=2)
        fill(self, radiance=radiance, _row_factors=rows, _column_factors=columns)
        shares = np.stack([np.cumsum(strength * r[:, None] * c) for r, c in zip(rows, columns, strict=True)])
        solid_angles = (2.0 * np.pi / shape[1]) * np.diff(self.sines)
        fill(self, _shares=shares, strength_sums=np.cumsum(strength * solid_angles[:, None]))
        fill(self, _through=np.einsum("hwc,kh,kw->kc", radiance, rows, columns, optimize=True))

    def shadow_rays(self, points: np.ndarray, uniforms: np.ndarray) -> ShadowRays:
        """Into a pixel chosen in proportion to its strongest channel times its solid angle, uniform within it."""
        width = self.radiance.shape[1]
        sums = self.strength_sums
        # First the row by one number, then the column by the other, so that evenly spread numbers stay spread.
        ends = sums[width - 1 :: width]
        row, up = choose(ends, uniforms[:, 1])
        start = np.where(row > 0, ends[row - 1], 0.0)
        scaled = start + uniforms[:, 0] * (ends[row] - start)
        pixel = np.clip(np.searchsorted(sums, scaled, side="right"), row * width, row * width + width - 1)
        low, high = np.where(pixel > 0, sums[pixel - 1], 0.0), sums[pixel]
        across = np.divide(scaled - low, high - low, out=np.zeros(len(row)), where=high > low)
        column = pixel - row * width
        travel, _ = self._within(row, column, np.clip(across, 0.0, 1.0), up)
        radiance, density = self._seen(row, column)
        return ShadowRays(-travel, np.full(len(row), np.inf), radiance, np.where(density > 0.0, density, 1.0))

    def met(self, points: np.ndarray, directions: np.ndarray, triangle: np.ndarray, places: np.ndarray):
        """Radiance (K, 3) of the pixels that rays out of the scene look at, and the density (K,) of aiming there."""
        height, width = self.radiance.shape[:2]
        x, y, z = directions.T
        up = np.arctan2(z, np.hypot(x, y)) / np.pi + 0.5
        across = 0.5 - np.arctan2(y, x) / (2.0 * np.pi)
        row = np.minimum((up * height).astype(np.int64), height - 1)
        column = np.minimum((across * width).astype(np.int64), width - 1)
        radiance, density = self._seen(row, column)
        left = triangle < 0
        return np.where(left[:, None], radiance, 0.0), np.where(left, density, 0.0)

    def _seen(self, row: np.ndarray, column: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radiance (K, 3) of pixels and the density (K,) per steradian of choosing them."""
        radiance = self.radiance[row, column]
        strength = np.abs(radiance).max(axis=1)
        return radiance, strength / max(self.strength_sums[-1], np.finfo(float).tiny)

    @property
    def sines(self) -> np.ndarray:
        """Sines (H + 1,) of the latitudes of the rows' borders."""
        return np.sin(_latitudes(len(self.radiance)))

    def flux(self, bounds: Bounds) -> np.ndarray:
        """Radiant flux (3,) in W that enters the box."""
        return bounds.face_areas @ self._through

    def emit(self, uniforms: np.ndarray, bounds: Bounds) -> Particles:
        """Particles on the faces of the box; uniforms (P, 4): axis, pixel and azimuth, latitude, origin 2.

        The axis of the face and the pixel are chosen in proportion to the flux of the pixel's strongest channel through
        faces of that axis, and the direction uniformly in the pixel's solid angle, so a particle's flux varies only by
        |w_axis| over its mean in the pixel.
        """
        power = bounds.face_areas * self._shares[:, -1]
        axis, left = choose(np.cumsum(power), uniforms[:, 0])
        pixel, left = self._choose_pixels(axis, left)
        row, column = np.divmod(pixel, self.radiance.shape[1])
        directions, solid_angle = self._within(row, column, left, uniforms[:, 1])
        along = directions[np.arange(len(axis)), axis]
        origins = face_points(bounds, axis, along < 0.0, uniforms[:, 2:])
        mean = self._row_factors[axis, row] * self._column_factors[axis, column] / solid_angle
        radiance = self.radiance[row, column]
        strength = np.abs(radiance).max(axis=1)
        scale = np.divide(np.abs(along) / mean, strength, out=np.zeros_like(strength), where=strength > 0.0)
        return Particles(origins, directions, radiance * (scale * (power.sum() / len(uniforms)))[:, None])

    def _choose_pixels(self, axis: np.ndarray, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pixel, left = np.empty(len(axis), np.int64), np.empty(len(axis))
        for k in range(3):
            here = np.flatnonzero(axis == k)
            pixel[here], left[here] = choose(self._shares[k], uniforms[here])
        return pixel, left

    def _within(self, row, column, across, up) -> tuple[np.ndarray, np.ndarray]:
        """Directions of travel (P, 3), uniform in solid angle in the pixels, and the pixels' solid angles (P,)."""
        width = self.radiance.shape[1]
        azimuth = 2.0 * np.pi * (0.5 - (column + across) / width)
        low, high = self.sines[row], self.sines[row + 1]
        z = low + up * (high - low)
        level = np.sqrt(np.maximum(1.0 - z * z, 0.0))
        towards = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), z], axis=1)
        return -towards, (2.0 * np.pi / width) * (high - low)


def _latitudes(height: int) -> np.ndarray:
    """Latitudes (height + 1,) of the rows' borders, radians."""
    return np.pi * (np.arange(height + 1) / height - 0.5)


def _factors(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Row (3, H) and column (3, W) factors of the integrals of |w_x|, |w_y|, |w_z| over each pixel."""
    latitude = _latitudes(height)
    azimuth = 2.0 * np.pi * (0.5 - np.arange(width + 1) / width)
    level = np.diff(0.5 * (latitude + np.sin(latitude) * np.cos(latitude)))
    upright = np.diff(0.5 * np.sin(latitude) * np.abs(np.sin(latitude)))
    x = -np.diff(_integral_of_abs_cos(azimuth))
    y = -np.diff(_integral_of_abs_cos(azimuth - 0.5 * np.pi))
    return np.stack([level, level, upright]), np.stack([x, y, np.full(width, 2.0 * np.pi / width)])


def _integral_of_abs_cos(angle: np.ndarray) -> np.ndarray:
    """The integral of |cos| from 0 to ``angle``."""
    turns = np.round(angle / np.pi)
    return 2.0 * turns + np.sin(angle - np.pi * turns)
