"""The scripts of docs/scripting.md do what they say, and the page knows all arguments."""

import re
from pathlib import Path

import bpy
import numpy as np
import pytest
from detp import detp_addon
from detp.detp_addon.panel.properties import BakeOptions
from glb import Glb
from small_scenes import colours

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "scripting.md").read_text(encoding="utf-8")
BAKE, REMOVE = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def unregistered():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield
    detp_addon.unregister()


def test_scripts_bake_export_and_take_all_out_again(unregistered, tmp_path):
    exported = tmp_path / "cornell_box.glb"
    bake = BAKE.replace("sample_blends/", f"{ROOT.as_posix()}/sample_blends/")
    exec(bake.replace(exported.name, exported.as_posix()))
    floor = bpy.data.objects["Floor"]
    light = colours("Floor")[:, :3]
    seen = Glb(exported).corners("Floor", "COLOR_0")[1]
    assert set(np.round(seen, 5).ravel()) == set(np.round(light, 5).ravel())
    assert light.max() > 2 * light.min() > 0
    exec(REMOVE)
    assert "detp_bakes" not in floor.data and len(floor.data.color_attributes) == 0
    assert not any("detp_light" in each for each in bpy.data.materials)


def test_the_page_names_every_argument():
    rows = "".join(re.findall(r"^\| (`.*?) \|", PAGE, re.MULTILINE))
    assert set(re.findall(r"`(\w+)`", rows)) == set(BakeOptions.__annotations__)
