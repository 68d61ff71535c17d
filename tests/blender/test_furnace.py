"""White furnaces made in Blender and read by the add-on: every vertex and every corner must read one."""

import numpy as np
import pytest

pytest.importorskip("bpy")

from detp.core.estimator.standpoints import Standpoints, standpoints
from detp.core.rays import RayCaster
from enclosures import ENCLOSURES, furnace
from furnace_table import ALLOWED, baked_with, elements, errors, limit, placed_discs

RAYS = 200

#: metres; each domain with another one, to save time
RADII = {"CORNER": 0.02, "POINT": 0.1}


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
@pytest.mark.parametrize("name", ENCLOSURES)
def test_without_noise_every_element_reads_one(name, domain):
    enclosure = furnace(ENCLOSURES[name], domain)
    placed = placed_discs(enclosure, RADII[domain])
    values = limit(enclosure, placed, RAYS, np.random.default_rng(3))
    exported = enclosure.exported
    places = standpoints(RayCaster(exported.scene.corners), exported.centres, exported.facing, exported.inward)
    hidden = placed.area.hidden | (Standpoints.joined(list(places)).enclosed & (values == 0))
    # Of a value that is off by just as much as allowed the rays' count varies so much.
    error = np.sqrt(ALLOWED * (1 - ALLOWED) / RAYS)
    reading = elements(enclosure, hidden, values, np.full(len(values), error))
    assert reading.wrong == 0
    assert reading.values.mean() == pytest.approx(1, abs=0.001)
    assert reading.filled < 0.25 * len(reading.values)


@pytest.mark.parametrize("name, domain", [
    ("L-shaped room, inner walls of 1 cm", "CORNER"), ("box sunk into the floor", "POINT"),
    ("UV sphere, smooth", "POINT"), ("half-open door", "CORNER"),
])  # fmt: skip
def test_a_bake_reads_one_within_its_noise(name, domain):
    enclosure = furnace(ENCLOSURES[name], domain)
    result = baked_with(enclosure, "visible", 0.1, 200_000)
    noise = errors(result, placed_discs(enclosure, 0.1).area.areas)
    reading = elements(enclosure, result.hidden, result.irradiance[:, 0], noise)
    assert reading.values.mean() == pytest.approx(1, abs=ALLOWED)
    # A few of hundreds of elements lie beyond three standard errors, and none beyond five.
    assert reading.wrong < 0.01
    assert (np.abs(reading.values - 1) < ALLOWED + 5 * reading.errors).all()


def test_the_plain_estimator_is_dark_where_faces_meet():
    enclosure = furnace(ENCLOSURES["closed box"], "CORNER")
    result = baked_with(enclosure, "plain", 0.1, 100_000)
    assert elements(enclosure, result.hidden, result.irradiance[:, 0], result.standard_error[:, 0]).wrong > 0.3
