"""Reads the study's scenes from their files: estimation points, and photons traced as a bake traces them."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...core.direct.direct_light import DirectLight
from ...core.direct.stands import Stands
from ...core.estimator.standpoints import Standpoints, standpoints
from ...core.photons.emission import lights_of
from ...core.photons.tracing import PhotonTracer
from ...core.radius import chosen_disc
from ...core.rays import RayCaster
from ...core.refinement import FIRST_ROUNDS
from ...core.segments import Segments
from ...core.settings import BakeSettings
from ...core.study.scene import StudyScene
from ..command.blender_output import blender_silenced
from ..files.open_files import check_readable, open_blend
from ..reading.read_scene import read_scene

#: particles traced at a time
PHOTONS = 1 << 15


def load_study_scene(name: str, path: Path, segments: int) -> StudyScene:
    """Read the scene in ``path`` and trace photons until there are that many ``segments``, of direct light too.

    Points are the face corners of all visible meshes. Raises DetpError when the scene cannot be read or baked.
    """
    check_readable(path)
    with blender_silenced():
        open_blend(path)
        export = read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER")
    caster = RayCaster(export.scene.corners, export.centres)
    settings = BakeSettings(quality="preview")
    places = Standpoints.joined(list(standpoints(caster, export.centres, export.facing, export.inward)))
    stands = Stands(export.centres, places.origins, export.facing)
    direct = DirectLight(export.scene, caster, stands, export.normals, settings, lights_of(export.scene))
    for _ in direct.rounds(0, FIRST_ROUNDS):
        pass
    disc = chosen_disc(
        export.scene, caster, export.centres, export.normals, settings, direct.irradiance.value, ["indirect"]
    )
    tracer = PhotonTracer(export.scene, caster, export.scene.bounds.expanded(2 * disc.radius), settings.bounces)
    parts: list[Segments] = []
    while sum(map(len, parts)) < segments:
        generator = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(2, len(parts))))
        parts.append(tracer.trace(PHOTONS, generator).segments)
    traced = Segments.joined(parts)
    # A bake leaves direct light to shadow rays, and searches the rest.
    searched = np.count_nonzero(traced.bounce) * disc.photons // (PHOTONS * len(parts))
    return StudyScene(
        name, len(export.scene.triangles), export.centres, export.normals, disc.radius, traced.spread(segments),
        max(1, searched),
    )  # fmt: skip
