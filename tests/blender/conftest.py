"""What tests in Blender share."""

import bpy
import pytest
from detp import detp_addon
from made_scenes import fresh, world


@pytest.fixture
def addon():
    """The add-on, registered in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    detp_addon.register()
    yield
    detp_addon.unregister()


@pytest.fixture
def scene():
    """An empty scene with a grey world."""
    return fresh()


@pytest.fixture
def dark_scene(scene):
    """The same with a black world."""
    world((0, 0, 0))
    return scene
