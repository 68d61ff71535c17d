"""The settings a user sees: on the scene for the panel, and as arguments of the bake operator."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ...core.settings import QUALITIES, BakeSettings
from ..request import BakeRequest
from ..writing.encoding import Encoding

RADIUS_TIP = (
    "Radius of the disc around each point that collects light: small is sharp and noisy, large smooth and blurred"
)
PHOTONS_TIP = "How many photons the lights send out; four times as many halve the noise"


def _quality(identifier: str, name: str, use: str) -> tuple[str, str, str]:
    return identifier, name, f"{use}: half of the points are to be off by less than {QUALITIES[identifier.lower()]:.1%}"


# No "from __future__ import annotations" here: Blender reads the properties from the annotations' values.
class BakeOptions:
    """What the scene's settings and the operator's arguments have in common; BakeRequest checks the values.

    SKIP_SAVE keeps Blender from handing the last call's arguments to the next one in place of the panel's settings;
    the scene's settings are saved with the file all the same.
    """

    quality: EnumProperty(
        name="Quality",
        description="When the light is good enough: a smaller error takes more time and shows finer detail",
        items=[
            _quality("DRAFT", "Draft", "A quick look"),
            _quality("PREVIEW", "Preview", "Good enough to judge the light"),
            _quality("FINAL", "Final", "The light to keep"),
            ("ERROR", "Error", "Bake until an error of your choice is reached"),
            ("TIME", "Time", "Bake for a time of your choice, and get the best that it allows"),
        ],
        default="PREVIEW",
        options={"SKIP_SAVE"},
    )
    error: FloatProperty(
        name="Error",
        description="Half of the points are to be off by less, as far as can be estimated",
        subtype="PERCENTAGE",
        min=0.1,
        soft_min=0.5,
        soft_max=20.0,
        max=99.0,
        default=5.0,
        precision=1,
        options={"SKIP_SAVE"},
    )
    seconds: FloatProperty(
        name="Time",
        description="How long the bake takes, from reading the scene to writing the colours",
        unit="TIME_ABSOLUTE",
        min=0.1,
        soft_min=1.0,
        soft_max=600.0,
        default=10.0,
        options={"SKIP_SAVE"},
    )
    live: BoolProperty(
        name="Show While Baking",
        description="Show the light in the viewport as soon as there is some, ever better until the bake is done. "
        "Cancelling takes it back",
        default=True,
        options={"SKIP_SAVE"},
    )
    keep: BoolProperty(
        name="Keep for Updates",
        description="Keep in memory, until the file is closed, what Update needs to find the light anew after objects "
        "were moved, added, removed or given other materials, in a part of the time of a bake. It may be a gigabyte",
        default=False,
        options={"SKIP_SAVE"},
    )
    keep_on_disk: BoolProperty(
        name="Beside the File",
        description="When the file is saved, write what is kept beside it, so that Update works after it is opened "
        "again. It may be hundreds of megabytes",
        default=False,
        options={"SKIP_SAVE"},
    )
    targets: EnumProperty(
        name="Objects",
        description="Which meshes get the colours; the whole scene casts and reflects light either way",
        items=[
            ("VISIBLE", "Visible", "Every mesh object that a render of this view layer shows"),
            ("SELECTED", "Selected", "The selected mesh objects alone"),
        ],
        default="VISIBLE",
        options={"SKIP_SAVE"},
    )
    gatherer: EnumProperty(
        name="Gatherer",
        description="How to search for the photon paths near each point; all find the same light, at different speed",
        items=[
            ("AUTO", "Automatic", "The fastest: Disc Indexing"),
            (
                "DISC_INDEX",
                "Disc Indexing",
                "Follow each photon path through a tree over the points",
            ),
            (
                "SPHERE_CACHE",
                "Sphere Cache",
                "Follow the points with nested lists of photon paths, as the study's other search",
            ),
            (
                "HYBRID",
                "Hybrid",
                "Disc Indexing, and in updates Sphere Cache around what changed; in a bake by itself nothing moves",
            ),
            ("BRUTE_FORCE", "Brute Force", "Test every point against every photon path; slow, to check the others"),
        ],
        default="AUTO",
        options={"SKIP_SAVE"},
    )
    radius: FloatProperty(
        name="Radius",
        description=RADIUS_TIP,
        unit="LENGTH",
        min=0.0,
        soft_min=0.001,
        soft_max=10.0,
        default=0.0,
        precision=3,
        options={"SKIP_SAVE"},
    )
    attribute: StringProperty(
        name="Attribute",
        description="Name of the colour attribute that receives the light. It is made where missing; "
        "other attributes stay as they are",
        default=BakeRequest().attribute,
        options={"SKIP_SAVE"},
    )
    domain: EnumProperty(
        name="Domain",
        description="Where on the mesh the colours are stored",
        items=[
            ("CORNER", "Face Corner", "Each face has its own light at its corners, so that edges stay sharp"),
            ("POINT", "Vertex", "One colour for each vertex: smaller, and smooth over edges"),
        ],
        default="CORNER",
        options={"SKIP_SAVE"},
    )
    fit: EnumProperty(
        name="Fit",
        description="What the colours are right for",
        items=[
            ("FACES", "Faces", "Colours such that the faces show their light between the vertices, as the eye sees it"),
            ("VERTICES", "Vertices", "The light at the vertices themselves, as Cycles bakes it"),
        ],
        default="FACES",
        options={"SKIP_SAVE"},
    )
    quantity: EnumProperty(
        name="Quantity",
        description="What the colours mean",
        items=[
            ("LIGHTING", "Lighting", "Light on a white surface (E/π), to multiply with textures"),
            ("IRRADIANCE", "Irradiance", "Physical irradiance E in W/m²"),
            ("SHADED", "Shaded", "Light times surface colour, plus emission: the colour that the surface shows"),
            ("AMBIENT_OCCLUSION", "Ambient Occlusion", "How open the surroundings are; the lights do not matter"),
        ],
        default="LIGHTING",
        options={"SKIP_SAVE"},
    )
    split: BoolProperty(
        name="Split Light",
        description="Write direct and indirect light also into attributes of their own, with _direct and _indirect "
        "after the name",
        default=False,
        options={"SKIP_SAVE"},
    )
    by_light: BoolProperty(
        name="By Light",
        description="Write the light of each light group (without any, of each lamp) also into an attribute of its "
        "own, which the light mixer mixes. Each group is baked to the error that is asked for",
        default=False,
        options={"SKIP_SAVE"},
    )
    occlusion_distance: FloatProperty(
        name="Distance",
        description="Surfaces farther away do not occlude. 0 takes a fifth of the scene's radius",
        unit="LENGTH",
        min=0.0,
        soft_max=10.0,
        default=0.0,
        options={"SKIP_SAVE"},
    )
    direct: EnumProperty(
        name="Direct Light",
        description="How light that comes straight from the lights is found",
        items=[
            ("AUTO", "Automatic", "Shadow rays; with the plain estimator photons, as in the study"),
            ("SHADOW_RAYS", "Shadow Rays", "Rays from each point to the lights: sharp shadows, little noise"),
            ("PHOTONS", "Photons", "The same photons as for the indirect light: blurred over the discs"),
            ("NONE", "None", "Leave direct light out"),
        ],
        default="AUTO",
        options={"SKIP_SAVE"},
    )
    indirect: EnumProperty(
        name="Indirect Light",
        description="How light that surfaces reflect is found",
        items=[
            ("AUTO", "Automatic", "Gathered; with the plain estimator by photons, as in the study"),
            ("GATHER", "Gathered", "Rays from each point look up what photons brought to the places they meet"),
            ("PHOTONS", "Photons", "Photons that cross discs at the points themselves, as in the study of 2006"),
            ("OFF", "Off", "Leave reflected light out"),
        ],
        default="AUTO",
        options={"SKIP_SAVE"},
    )
    estimator: EnumProperty(
        name="Estimator",
        description="Which part of each disc counts",
        items=[
            ("VISIBLE", "Visible", "The part that its point sees: right in corners, no light through thin walls"),
            ("PLAIN", "Plain", "The whole disc, as in the study of 2006: dark in concave corners"),
        ],
        default="VISIBLE",
        options={"SKIP_SAVE"},
    )
    photons: IntProperty(
        name="Photons",
        description=PHOTONS_TIP,
        min=0,
        soft_min=1000,
        default=0,
        options={"SKIP_SAVE"},
    )
    bounces: IntProperty(
        name="Bounces",
        description="Most reflections of one photon: surfaces absorb photons anyway, so a high limit costs little. "
        "0 bakes direct light alone",
        min=0,
        soft_max=128,
        default=BakeSettings.bounces,
        options={"SKIP_SAVE"},
    )
    seed: IntProperty(
        name="Seed",
        description="Start of the random numbers: the same seed gives the same light, another seed another noise",
        min=0,
        default=BakeSettings.seed,
        options={"SKIP_SAVE"},
    )
    fit_exposure: BoolProperty(
        name="Fit Exposure",
        description="Multiply the light so that 99 % of a scene's lit colours are 1 or less. The factor is noted in "
        "the meshes' custom property detp_bakes",
        default=False,
        options={"SKIP_SAVE"},
    )
    exposure: FloatProperty(
        name="Exposure",
        description="Multiply the light by two to the power of this before it is stored",
        soft_min=-10.0,
        soft_max=10.0,
        min=-32.0,
        max=32.0,
        default=0.0,
        precision=2,
        options={"SKIP_SAVE"},
    )
    clamp: BoolProperty(
        name="Cut at 1",
        description="Store nothing brighter than 1, as many formats and engines know nothing brighter",
        default=False,
        options={"SKIP_SAVE"},
    )
    storage: EnumProperty(
        name="Storage",
        description="How the colours are stored",
        items=[
            ("FLOAT", "Float", "32 bits a channel: any brightness, all shades"),
            ("BYTE", "Byte", "8 bits a channel in sRGB encoding: a quarter of the size, cut at 1"),
        ],
        default="FLOAT",
        options={"SKIP_SAVE"},
    )
    activate: BoolProperty(
        name="Activate",
        description="Make the attribute the one that the viewport and renders show. Off leaves their choice as it is. "
        "Later bakes read the paint below either way",
        default=True,
        options={"SKIP_SAVE"},
    )


class DETP_PG_settings(BakeOptions, bpy.types.PropertyGroup):
    """The panel's settings, saved with the scene. The operator knows a radius or photons of 0 instead of switches."""

    auto_radius: BoolProperty(
        name="Automatic",
        description="Choose the smallest radius that reaches the quality's error in this scene",
        default=True,
    )
    radius: FloatProperty(
        name="Radius",
        description=RADIUS_TIP,
        unit="LENGTH",
        min=1e-6,
        soft_min=0.001,
        soft_max=10.0,
        default=0.1,
        precision=3,
    )
    auto_photons: BoolProperty(
        name="As Needed",
        description="Send out as many photons as the error or the time asks for",
        default=True,
    )
    photons: IntProperty(
        name="Photons",
        description=PHOTONS_TIP,
        min=1,
        soft_min=1000,
        default=BakeSettings().expected_photons,
    )


def option_names() -> tuple[str, ...]:
    """The names of the settings that the operator's arguments can override."""
    return tuple(BakeOptions.__annotations__)


def attribute_name(settings: DETP_PG_settings) -> str:
    """The name of the attribute; an empty field means the usual one."""
    return settings.attribute or BakeRequest().attribute


def scene_options(settings: DETP_PG_settings) -> dict:
    """The scene's settings as arguments of the operator."""
    options = {name: getattr(settings, name) for name in option_names()}
    options["attribute"] = attribute_name(settings)
    if settings.auto_radius:
        options["radius"] = 0.0
    if settings.auto_photons:
        options["photons"] = 0
    return options


def bake_request(options: dict, metres: float = 1.0) -> BakeRequest:
    """The BakeRequest that the operator's arguments mean, in a scene of so many ``metres`` per unit.

    Blender shows its units as metres, and keeps them as they are. Raises InvalidSettingError.
    """
    goal = options["quality"].lower()
    settings = BakeSettings(
        quality=goal if goal in QUALITIES else "preview",
        error=options["error"] / 100.0 if goal == "error" else None,
        seconds=options["seconds"] if goal == "time" else None,
        photons=options["photons"] or None,
        radius=options["radius"] * metres or None,
        bounces=options["bounces"],
        seed=options["seed"],
        gatherer=core_name(options["gatherer"]),
        estimator=core_name(options["estimator"]),
        direct=None if options["direct"] == "AUTO" else core_name(options["direct"]),
        indirect=None if options["indirect"] == "AUTO" else core_name(options["indirect"]),
        shadow_distance=options["occlusion_distance"] * metres or None,
    )
    return BakeRequest(
        settings=settings,
        targets=options["targets"].lower(),
        attribute=options["attribute"],
        domain=options["domain"],
        fit=core_name(options["fit"]),
        quantity=core_name(options["quantity"]),
        split=options["split"],
        by_light=options["by_light"],
        activate=options["activate"],
        encoding=Encoding(
            exposure=None if options["fit_exposure"] else options["exposure"],
            clamp=options["clamp"],
            storage=core_name(options["storage"]),
        ),
    )


def core_name(identifier: str) -> str:
    """The core's word for an identifier of Blender's: ``DISC_INDEX`` is ``disc-index``."""
    return identifier.lower().replace("_", "-")


def register_properties() -> None:
    """Give every scene its settings as ``scene.detp``."""
    bpy.utils.register_class(DETP_PG_settings)
    bpy.types.Scene.detp = PointerProperty(type=DETP_PG_settings)


def unregister_properties() -> None:
    """Take ``scene.detp`` away; the values stay in the file."""
    del bpy.types.Scene.detp
    bpy.utils.unregister_class(DETP_PG_settings)
