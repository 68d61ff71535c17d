"""The report says the same to programs and to people."""

import json

from detp.detp_addon.report import BakeReport, Brightness, to_json
from detp.detp_addon.wording import counted

REPORT = BakeReport(
    scene="a.blend",
    objects=1,
    points=45210,
    filled=3,
    triangles=12,
    lights=2,
    shadow_rays=1_000_000,
    photons=2097152,
    segments=9,
    radius=0.25,
    gatherer="disc-index",
    gatherer_reason="small discs",
    seconds={"export": 0.5, "shadow": 0.1, "trace": 1.0, "gather": 2.0, "write": 0.1, "total": 3.75},
    relative_error=0.052,
    modelled=("2 point lights", "diffuse bounces"),
    left_out=("fog",),
    warnings=("Look here.",),
)


def test_json_has_every_key_in_a_stable_order():
    entry = REPORT.as_json()
    assert list(entry)[:6] == ["scene", "output", "objects", "points", "filled", "triangles"]
    assert set(entry) == {
        "scene", "output", "objects", "points", "triangles", "lights", "photons", "shadow_rays", "segments", "radius",
        "gatherer", "seconds", "relative_error", "high_error", "faces_lost", "wrong_faces", "modelled", "left_out",
        "light_groups", "frames", "updated", "warnings",
        "filled", "gatherer_reason", "blender_scene", "view_layer", "scale", "colours", "above_one",
    }  # fmt: skip
    assert set(entry["seconds"]) == {"export", "shadow", "trace", "gather", "write", "total"}
    assert json.loads(to_json([entry]))[0]["warnings"] == ["Look here."]


def test_an_error_that_does_not_exist_is_null_and_said_to_be_unknown():
    dark = BakeReport(**{**REPORT.__dict__, "relative_error": float("nan")})
    assert json.loads(to_json([dark.as_json()]))[0]["relative_error"] is None
    assert "median error unknown" in dark.headline()


def test_people_read_counts_and_everything_that_was_noticed():
    assert REPORT.headline() == (
        "Baked 1 object, 45 210 points with 2.1 M photons in 3.8 s; median error 5.2 % (radius 0.25 m, disc-index)."
    )
    both = BakeReport(**{**REPORT.__dict__, "high_error": 0.12}).headline()
    assert "median error 5.2 %, nine tenths of the points within 12.0 % (" in both
    assert REPORT.details() == [
        "Modelled: 2 point lights, diffuse bounces.",
        "Left out: fog.",
        "Filled from neighbours: 3 elements.",
        "Warning: Look here.",
    ]


def test_brightness_is_told_where_it_tells_something():
    assert Brightness(1.0, 0, 10).sentence() == ""
    assert Brightness(0.25, 0, 10).sentence() == "Exposed by -2.00 stops: no colour is above 1."
    assert "24 colours (24.0 %) are above 1" in Brightness(1.0, 24, 100).sentence()
    bright = BakeReport(**{**REPORT.__dict__, "brightness": Brightness(0.5, 1, 100)})
    assert bright.brightness.sentence() in bright.details()
    assert [bright.as_json()[name] for name in ("scale", "colours", "above_one")] == [0.5, 100, 1]


def test_counts():
    assert [counted(n, "point") for n in (0, 1, 999, 1000, 1_000_000)] == [
        "0 points", "1 point", "999 points", "1 000 points", "1 M points",
    ]  # fmt: skip
