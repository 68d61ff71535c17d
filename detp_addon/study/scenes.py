"""Reads the study's scenes from their files: estimation points, and photons traced as a bake traces them."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.bake import Baking
from ...core.photons.photon_light import PHOTONS_PER_TRACE
from ...core.random_streams import random_stream
from ...core.segments import Segments
from ...core.settings import BakeSettings
from ...core.stages import finished
from ...core.study.fields import StudyScene
from ..command.blender_output import blender_silenced
from ..files.open_files import open_blend
from ..reading.read_scene import read_scene


def load_study_scene(name: str, path: Path, segments: int) -> StudyScene:
    """Read the scene in ``path`` and trace photons until there are that many ``segments``, of direct light too.

    Points are the face corners of all visible meshes. Raises DetpError when the scene cannot be read or baked.
    """
    with blender_silenced():
        open_blend(path)
        export = read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER")
    work = Baking(export.scene, export.points, BakeSettings(quality="preview", indirect="photons"))
    for stage in (work.place_points, work.cast_first_rays, work.place_discs):
        finished(stage())
    parts: list[Segments] = []
    while sum(map(len, parts)) < segments:
        generator = random_stream(0, "photons", len(parts) * PHOTONS_PER_TRACE)
        parts.append(work.tracer.trace(PHOTONS_PER_TRACE, generator).segments)
    some = Segments.joined(parts).spread(segments)
    return StudyScene(name, len(export.scene.triangles), export.centres, export.normals, work.radius, some)
