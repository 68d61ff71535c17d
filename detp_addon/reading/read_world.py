"""Reads the world: one colour where its nodes say so, otherwise a picture of the sky made by Cycles."""

from __future__ import annotations

import numpy as np

from .findings import Findings
from .read_materials import even_emission, probed
from .read_node_graph import node_tree, output_feed
from .views import WORLD_RAYS


def world_colour(world, view_layer, findings: Findings) -> np.ndarray | None:
    """The radiance (3,) of an evaluated world that is the same in all directions, None when it is not.

    A world that is missing, or that diffuse light does not see, is black.
    """
    if world is None:
        return np.zeros(3)
    visibility = getattr(world, "cycles_visibility", None)
    if not view_layer.use_sky or (visibility and not visibility.diffuse):
        findings.left_out("the world, which is hidden from diffuse light")
        return np.zeros(3)
    tree = node_tree(world)
    if tree is not None and output_feed(tree, "Volume"):
        findings.left_out("the world's volume")
    radiance = np.array(world.color, np.float64) if tree is None else even_emission(tree, WORLD_RAYS)
    if radiance is not None and not np.isfinite(radiance).all():
        findings.warn("the world gives no light, because its colour or strength is not a number")
        return np.zeros(3)
    return radiance


#: what Cycles' camera tells a world's nodes, as Probe names it; for the picture of a world it is another camera
_OF_THE_CAMERA = {"texture coordinates (Camera)", "texture coordinates (Window)", "Camera Data"}


def note_world(world, mirrors: bool, findings: Findings) -> None:
    """Name what a world shows to the camera's place, or, where there are ``mirrors`` or glass, to those alone."""
    tree = node_tree(world) if world is not None else None
    feed = output_feed(tree) if tree is not None else None
    if feed is None:
        return
    probe, _ = probed(feed)
    if probe.strange & _OF_THE_CAMERA:
        findings.left_out("the camera's place in the world's nodes, which are seen from the middle of all instead")
    for depth in sorted(each for each in probe.strange if each.startswith("Light Path")):
        findings.warn(f"a plain value takes the place of {depth} in the world")
    if mirrors and "mirrors" in probe.asks:
        findings.left_out("what the world shows to mirrors and through glass alone")
