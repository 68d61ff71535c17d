"""The settings a user sees: on the scene for the panel, and as arguments of the bake operator."""

from functools import partial

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...core.settings import QUALITIES, BakeSettings
from ..request import BakeRequest
from ..writing.encoding import Encoding

RADIUS_TIP = (
    "Radius of the disc around each point that collects light: small is sharp and noisy, large smooth and blurred"
)
PHOTONS_TIP = "How many photons the lights send out; four times as many halve the noise"


def _setting(kind, name: str, description: str, default, **more):
    """A property that is a setting and an argument of an operator, of which the last call's is not the next one's."""
    return kind(name=name, description=description, default=default, options={"SKIP_SAVE"}, **more)


Flag, Choice, Number, Whole, Text = (
    partial(_setting, kind) for kind in (BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty)
)


def _quality(identifier: str, name: str, use: str) -> tuple[str, str, str]:
    return identifier, name, f"{use}: half of the points are to be off by less than {QUALITIES[identifier.lower()]:.1%}"


# No "from __future__ import annotations" here: Blender reads the properties from the annotations' values.
# fmt: off
class BakeOptions:
    """What the scene's settings and the operator's arguments have in common; BakeRequest checks the values.

    Blender does not hand the last call's arguments to the next one in place of the panel's settings; the scene's
    settings are saved with the file all the same.
    """

    quality: Choice(
        "Quality", "When the light is good enough: a smaller error takes more time and shows finer detail", "PREVIEW",
        items=[
            _quality("DRAFT", "Draft", "A quick look"),
            _quality("PREVIEW", "Preview", "Good enough to judge the light"),
            _quality("FINAL", "Final", "The light to keep"),
            ("ERROR", "Error", "Bake until an error of your choice is reached"),
            ("TIME", "Time", "Bake for a time of your choice, and get the best that it allows"),
        ],
    )
    error: Number(
        "Error", "Half of the points are to be off by less, as far as can be estimated", 5.0, subtype="PERCENTAGE",
        min=0.1, soft_min=0.5, soft_max=20.0, max=99.0, precision=1,
    )
    seconds: Number(
        "Time", "How long the bake takes, from reading the scene to writing the colours", 10.0, unit="TIME_ABSOLUTE",
        min=0.1, soft_min=1.0, soft_max=600.0,
    )
    live: Flag(
        "Show While Baking", "Show the light in the viewport as soon as there is some, ever better until the bake is "
        "done. Cancelling takes it back", True,
    )
    keep: Flag(
        "Keep for Updates", "Keep in memory, until the file is closed, what Update needs to find the light anew after "
        "objects were moved, added, removed or given other materials, in a part of the time of a bake. It may be a "
        "gigabyte", False,
    )
    keep_on_disk: Flag(
        "Beside the File", "When the file is saved, write what is kept beside it, so that Update works after it is "
        "opened again. It may be hundreds of megabytes", False,
    )
    targets: Choice(
        "Objects", "Which meshes get the colours; the whole scene casts and reflects light either way", "VISIBLE",
        items=[
            ("VISIBLE", "Visible", "Every mesh object that a render of this view layer shows"),
            ("SELECTED", "Selected", "The selected mesh objects alone"),
        ],
    )
    gatherer: Choice(
        "Gatherer", "How to search for the photon paths near each point; all find the same light, at different speed",
        "AUTO",
        items=[
            ("AUTO", "Automatic", "The fastest: Disc Indexing"),
            ("DISC_INDEX", "Disc Indexing", "Follow each photon path through a tree over the points"),
            ("SPHERE_CACHE", "Sphere Cache",
             "Follow the points with nested lists of photon paths, as the study's other search"),
            ("HYBRID", "Hybrid",
             "Disc Indexing, and in updates Sphere Cache around what changed; in a bake by itself nothing moves"),
            ("BRUTE_FORCE", "Brute Force", "Test every point against every photon path; slow, to check the others"),
        ],
    )
    radius: Number(
        "Radius", RADIUS_TIP, 0.0, unit="LENGTH", min=0.0, soft_min=0.001, soft_max=10.0, precision=3,
    )
    attribute: Text(
        "Attribute", "Name of the colour attribute that receives the light. It is made where missing; other attributes "
        "stay as they are", BakeRequest().attribute,
    )
    domain: Choice(
        "Domain", "Where on the mesh the colours are stored", "CORNER",
        items=[
            ("CORNER", "Face Corner", "Each face has its own light at its corners, so that edges stay sharp"),
            ("POINT", "Vertex", "One colour for each vertex: smaller, and smooth over edges"),
        ],
    )
    fit: Choice(
        "Fit", "What the colours are right for", "FACES",
        items=[
            ("FACES", "Faces", "Colours such that the faces show their light between the vertices, as the eye sees it"),
            ("VERTICES", "Vertices", "The light at the vertices themselves, as Cycles bakes it"),
        ],
    )
    quantity: Choice(
        "Quantity", "What the colours mean", "LIGHTING",
        items=[
            ("LIGHTING", "Lighting", "Light on a white surface (E/π), to multiply with textures"),
            ("IRRADIANCE", "Irradiance", "Physical irradiance E in W/m²"),
            ("SHADED", "Shaded", "Light times surface colour, plus emission: the colour that the surface shows"),
            ("AMBIENT_OCCLUSION", "Ambient Occlusion", "How open the surroundings are; the lights do not matter"),
        ],
    )
    split: Flag(
        "Split Light", "Write direct and indirect light also into attributes of their own, with _direct and _indirect "
        "after the name", False,
    )
    by_light: Flag(
        "By Light", "Write the light of each light group (without any, of each lamp) also into an attribute of its "
        "own, which the light mixer mixes. Each group is baked to the error that is asked for", False,
    )
    occlusion_distance: Number(
        "Distance", "Surfaces farther away do not occlude. 0 takes a fifth of the scene's radius", 0.0, unit="LENGTH",
        min=0.0, soft_max=10.0,
    )
    direct: Choice(
        "Direct Light", "How light that comes straight from the lights is found", "AUTO",
        items=[
            ("AUTO", "Automatic", "Shadow rays; with the plain estimator photons, as in the study"),
            ("SHADOW_RAYS", "Shadow Rays", "Rays from each point to the lights: sharp shadows, little noise"),
            ("PHOTONS", "Photons", "The same photons as for the indirect light: blurred over the discs"),
            ("NONE", "None", "Leave direct light out"),
        ],
    )
    indirect: Choice(
        "Indirect Light", "How light that surfaces reflect is found", "AUTO",
        items=[
            ("AUTO", "Automatic", "Gathered; with the plain estimator by photons, as in the study"),
            ("GATHER", "Gathered", "Rays from each point look up what photons brought to the places they meet"),
            ("PHOTONS", "Photons", "Photons that cross discs at the points themselves, as in the study of 2006"),
            ("OFF", "Off", "Leave reflected light out"),
        ],
    )
    estimator: Choice(
        "Estimator", "Which part of each disc counts", "VISIBLE",
        items=[
            ("VISIBLE", "Visible", "The part that its point sees: right in corners, no light through thin walls"),
            ("PLAIN", "Plain", "The whole disc, as in the study of 2006: dark in concave corners"),
        ],
    )
    photons: Whole("Photons", PHOTONS_TIP, 0, min=0, soft_min=1000)
    bounces: Whole(
        "Bounces", "Most reflections of one photon: surfaces absorb photons anyway, so a high limit costs little. 0 "
        "bakes direct light alone", BakeSettings.bounces, min=0, soft_max=128,
    )
    seed: Whole(
        "Seed", "Start of the random numbers: the same seed gives the same light, another seed another noise",
        BakeSettings.seed, min=0,
    )
    fit_exposure: Flag(
        "Fit Exposure", "Multiply the light so that 99 % of a scene's lit colours are 1 or less. The factor is noted "
        "in the meshes' custom property detp_bakes", False,
    )
    exposure: Number(
        "Exposure", "Multiply the light by two to the power of this before it is stored", 0.0, soft_min=-10.0,
        soft_max=10.0, min=-32.0, max=32.0, precision=2,
    )
    clamp: Flag("Cut at 1", "Store nothing brighter than 1, as many formats and engines know nothing brighter", False)
    storage: Choice(
        "Storage", "How the colours are stored", "FLOAT",
        items=[
            ("FLOAT", "Float", "32 bits a channel: any brightness, all shades"),
            ("BYTE", "Byte", "8 bits a channel in sRGB encoding: a quarter of the size, cut at 1"),
        ],
    )
    activate: Flag(
        "Activate", "Make the attribute the one that the viewport and renders show. Off leaves their choice as it is. "
        "Later bakes read the paint below either way", True,
    )
# fmt: on


class DETP_PG_settings(BakeOptions, bpy.types.PropertyGroup):
    """The panel's settings, saved with the scene. The operator knows a radius or photons of 0 instead of switches."""

    auto_radius: Flag("Automatic", "Choose the smallest radius that reaches the quality's error in this scene", True)
    radius: Number("Radius", RADIUS_TIP, 0.1, unit="LENGTH", min=1e-6, soft_min=0.001, soft_max=10.0, precision=3)
    auto_photons: Flag("As Needed", "Send out as many photons as the error or the time asks for", True)
    photons: Whole("Photons", PHOTONS_TIP, BakeSettings().expected_photons, min=1, soft_min=1000)


def attribute_name(settings: DETP_PG_settings) -> str:
    """The name of the attribute; an empty field means the usual one."""
    return settings.attribute or BakeRequest().attribute


def scene_options(settings: DETP_PG_settings) -> dict:
    """The scene's settings as arguments of the operator."""
    options = {name: getattr(settings, name) for name in BakeOptions.__annotations__}
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
        shadow_distance=options["occlusion_distance"] * metres or None,
        **{name: options[name] for name in ("bounces", "seed")},
        **{name: core_name(options[name]) for name in ("gatherer", "estimator")},
        **{way: None if options[way] == "AUTO" else core_name(options[way]) for way in ("direct", "indirect")},
    )
    exposure = None if options["fit_exposure"] else options["exposure"]
    return BakeRequest(
        settings=settings,
        encoding=Encoding(exposure, options["clamp"], core_name(options["storage"])),
        **{name: options[name] for name in ("attribute", "domain", "split", "by_light", "activate")},
        **{name: core_name(options[name]) for name in ("targets", "fit", "quantity")},
    )


def core_name(identifier: str) -> str:
    """The core's word for an identifier of Blender's: ``DISC_INDEX`` is ``disc-index``."""
    return identifier.lower().replace("_", "-")


CLASSES = (DETP_PG_settings,)
