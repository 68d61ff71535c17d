"""Reads materials: what the triangles of all meshes reflect, give off and let through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .bent_patterns import bends_patterns
from .findings import Findings
from .read_colour_nodes import COLOUR_RULES
from .read_images import Images
from .read_input_nodes import INPUT_RULES
from .read_node_graph import Feed, node_tree, output_feed
from .read_shaders import DEFAULT_ALBEDO, Shaders
from .read_values import Values
from .response import Response
from .surface_places import PATCHES, Nowhere, Patches, Probe, WhereaboutsUnknown
from .views import COSINES, SHADOW_RAYS, VIEWS, View, same_view

RULES = {**INPUT_RULES, **COLOUR_RULES}

#: triangles evaluated at once
_CHUNK = 1 << 14

#: Images whose texels a node bends are looked at so many times a patch, by how many triangles there are.
_DRAWS = ((1 << 11, 64), (1 << 14, 16), (1 << 62, 4))

#: indices of refraction are brought into this range
_IOR = (0.01, 100.0)

#: the quarters (4, 16) of a triangle, three at its corners and one between them, as means over its PATCHES
_QUARTERS = np.stack([*(PATCHES > 0.5).T, (PATCHES < 0.5).all(axis=1)]) / 4.0

#: how far what quarters of a triangle do may differ, where one value stands for all
_EVEN = {"transmittance": 0.1, "spread": 0.1, "albedo": 0.25, "emission": 0.25}

#: how far rounding may push a share above 1 without a word
_ROUNDING = 1e-4


@dataclass(frozen=True)
class Recipe:
    """How to find out what a material does to light.

    name      of the material, "" for none
    fixed     its response (one row) when no nodes make it
    feed      of the output's surface otherwise, None when nothing is linked there
    needs     what its nodes ask of the mesh and its object; empty when it is the same everywhere
    asks      "rays", "side", "angle" and "mirrors", where it depends on those (see Probe)
    specular  whether it may mirror or refract
    opaque    whether what lets light through throws a full shadow in Cycles
    index     pass index of the material
    bends     whether nodes make of texels what they do not make of the mean of texels
    alphas    the image nodes whose alpha is asked for
    """

    name: str
    fixed: Response | None = None
    feed: Feed | None = None
    needs: frozenset[tuple[str, str]] = frozenset()
    asks: frozenset[str] = frozenset()
    specular: bool = False
    opaque: bool = False
    index: int = 0
    bends: bool = False
    alphas: frozenset[int] = frozenset()


class Materials:
    """Knows each material's recipe, and evaluates it. What cannot be honoured is named in ``findings``."""

    def __init__(self, findings: Findings):
        self._findings = findings
        self._images = Images(findings)
        self._noted: set[int] = set()
        self._told_mirrors: list[str] = []
        self._uneven = np.zeros(0, bool)
        self._recipes: dict[int, Recipe] = {0: Recipe("", fixed=Response.of(albedo=DEFAULT_ALBEDO))}

    def recipe(self, material) -> Recipe:
        """How to evaluate an evaluated material, or None for a slot without one."""
        pointer = material.as_pointer() if material else 0
        if pointer not in self._recipes:
            self._recipes[pointer] = _recipe(material)
        return self._recipes[pointer]

    def note(self, material) -> None:
        """Name what a material in use has that is not read at all."""
        pointer = material.as_pointer()
        if pointer in self._noted:
            return
        self._noted.add(pointer)
        tree = node_tree(material)
        for name, sentence in (("Volume", "volumes of {}"), ("Displacement", "displacement of {}")):
            if tree is not None and output_feed(tree, name) is not None:
                self._findings.left_out(sentence, "material", material.name)

    def note_mirrors(self) -> None:
        """Name the materials met that look otherwise to mirrors and through glass, which a scene with such asks for."""
        for name in self._told_mirrors:
            self._findings.left_out("what {} show to mirrors and through glass alone", "material", name)

    def name_straight(self, panes: list[str], sheets: list[str]) -> None:
        """Name the materials of glass ``panes``, and of single ``sheets`` of glass, which do not bend light here."""
        for name in panes:
            self._findings.left_out("how panes of {} bend and spread light: it passes straight, as much at every angle",
                                    "material", name)  # fmt: skip
        for name in sheets:
            self._findings.left_out("how {} of glass on open faces bend light, once in renders: it passes straight, as "
                                    "through panes", "material", name)  # fmt: skip

    def evaluate(
        self, recipe: Recipe, corners: dict[tuple[str, str], np.ndarray], count: int
    ) -> tuple[dict[int, Response], np.ndarray]:
        """The mean response (count rows) of each triangle in those of VIEWS that differ, by their numbers.

        And which triangles (count,) have a pattern that their mean does not show. ``corners`` has the recipe's needs at
        the triangles' corners (count, 3, c).
        """
        self._uneven = np.zeros(count, bool)
        if "mirrors" in recipe.asks:
            self._told_mirrors.append(recipe.name)
        numbers = sorted({same_view(number, recipe.asks) for number in range(len(VIEWS))})
        found = {number: self._evaluated(recipe, corners, count, VIEWS[number]) for number in numbers}
        met, looked_at = ([found[same_view(first + side, recipe.asks)].emission for side in (0, 1)] for first in (0, 4))
        if not np.array_equal(met, looked_at):
            self._findings.left_out("light of {} that differs by the kind of ray, for all of which it is as rays to "
                                    "lamps meet it", "material", recipe.name)  # fmt: skip
        specular = [(response.mirror, response.gloss, response.clear) for response in found.values()]
        if any((one != other).any() for view in specular for one, other in zip(view, specular[0], strict=True)):
            self._findings.left_out("mirrors and glass of {} that differ by the side or the kind of ray", "material",
                                    recipe.name)  # fmt: skip
        return found, self._uneven

    def _evaluated(self, recipe: Recipe, corners, count: int, view: View) -> Response:
        if recipe.fixed is not None:
            return _repeated(self._physical(recipe.fixed, recipe.name), count)
        if not recipe.needs:
            return _repeated(self._physical(self._raw(recipe, {}, view), recipe.name), count)
        draws = range(next(draws for most, draws in _DRAWS if count <= most)) if recipe.bends else (None,)
        parts = []
        for start in range(0, count, _CHUNK):
            rows = slice(start, min(start + _CHUNK, count))
            raw = self._raw(recipe, {key: values[rows] for key, values in corners.items()}, view, draws)
            self._uneven[rows] |= _uneven(raw, rows.stop - rows.start)
            parts.append(self._physical(_triangle_means(raw, rows.stop - rows.start), recipe.name))
        return Response.joined(parts)

    def _raw(self, recipe: Recipe, corners, view: View, draws: Sequence[int | None] = (None,)) -> Response:
        def unknown(feature):
            self._findings.warn(f"a plain value takes the place of {feature} in {{}}", "material", recipe.name)

        def left_out(sentence):
            self._findings.left_out(sentence, "material", recipe.name)

        if recipe.feed is None:
            return Response.of()
        cosines, whole = COSINES if "angle" in recipe.asks else (1.0,), None
        looks = [(cosine, draw) for cosine in cosines for draw in draws]
        for cosine, draw in looks:
            seen = replace(view, cosine=cosine)
            places = Patches(corners, self._images, unknown, seen, recipe.index, recipe.alphas, draw)
            with np.errstate(all="ignore"):
                response = Shaders(Values(places, RULES), left_out).response(recipe.feed)
            part = response.scaled(np.full((1, 1), 1.0 / len(looks)))
            whole = part if whole is None else whole.plus(part)
        if recipe.opaque and view.rays is SHADOW_RAYS:
            whole = replace(whole, transmittance=np.zeros((1, 3)))
        return whole

    def _physical(self, raw: Response, name: str) -> Response:
        """The response with shares brought into 0..1 and together to at most 1 in each channel."""
        findings = self._findings
        if not all(np.isfinite(array).all() for array in raw.arrays):
            findings.warn("values that are not numbers count as grey or none in {}", "material", name)
        albedo = np.nan_to_num(raw.albedo, nan=DEFAULT_ALBEDO, posinf=1.0, neginf=0.0)
        emission = np.nan_to_num(raw.emission, nan=0.0, posinf=0.0, neginf=0.0)
        others = [raw.transmittance, raw.mirror, raw.gloss, raw.clear, raw.spread, raw.highlight]
        shares = [albedo, *(np.nan_to_num(share, nan=0.0, posinf=1.0, neginf=0.0) for share in others)]
        most = max(share.max(initial=0.0) for share in (*shares, _together(*shares)))
        if most > 1.0 + _ROUNDING:
            findings.warn("colours that give off more light than arrives are scaled down in {}", "material", name)
        shares = [np.clip(share, 0.0, 1.0) for share in shares]
        total = np.maximum(_together(*shares), 1.0)
        albedo, through, mirror, gloss, clear, spread, highlight = (share / total for share in shares)
        if emission.any():
            findings.modelled("emission of {}", "material", name)
        if through.any():
            findings.modelled("light passing straight through {}", "material", name)
        if spread.any():
            findings.modelled("light spread by {} to the other side", "material", name)
            findings.left_out("what shines through {} in their own colours, which show the light in front", "material",
                              name)  # fmt: skip
        if mirror.any():
            findings.modelled("mirror reflection of {}", "material", name)
        if clear.any() or gloss.any():
            findings.modelled(
                "refraction of {}, straight passage where it is a pane or an open sheet", "material", name
            )
        roughness = np.clip(np.nan_to_num(raw.roughness), 0.0, 1.0)
        ior = np.clip(np.nan_to_num(raw.ior, nan=1.0), *_IOR)
        return Response.of(albedo, emission, through, mirror, gloss, clear, roughness, ior, spread, highlight)


def _together(albedo, through, mirror, gloss, clear, spread, highlight) -> np.ndarray:
    return albedo + through + mirror + spread + highlight + np.maximum(gloss, clear)


def _recipe(material) -> Recipe:
    tree = node_tree(material)
    if tree is None:
        return Recipe(material.name, fixed=Response.of(albedo=tuple(material.diffuse_color)[:3]))
    feed = output_feed(tree)
    if feed is None:
        through = 1.0 if output_feed(tree, "Volume") else 0.0
        return Recipe(material.name, fixed=Response.of(transmittance=through))
    probe, shaders = probed(feed)
    opaque = not getattr(material, "use_transparent_shadow", True) and shaders.passes
    asks = frozenset(probe.asks | ({"rays"} if opaque else set()))
    needs = frozenset(probe.needs)
    alphas, bends = frozenset(probe.alphas), bends_patterns(feed)
    return Recipe(material.name, None, feed, needs, asks, shaders.specular, opaque, material.pass_index, bends, alphas)


def _uneven(raw: Response, count: int) -> np.ndarray:
    """Whether (count,) the quarters of each triangle differ by more than _EVEN allows; of emission, as a share."""
    uneven = np.zeros(count, bool)
    for name, most in _EVEN.items():
        array = np.nan_to_num(getattr(raw, name))
        if len(array) == 1:
            continue
        quarters = np.einsum("qp,tpc->tqc", _QUARTERS, array.reshape(count, len(PATCHES), -1))
        scale = np.abs(quarters).max(initial=0.0) if name == "emission" else 1.0
        uneven |= (np.ptp(quarters, axis=1) > most * scale).any(axis=1)
    return uneven


def probed(feed: Feed) -> tuple[Probe, Shaders]:
    """What the shader that ``feed`` leads to asks for."""
    probe = Probe()
    with np.errstate(all="ignore"):
        shaders = Shaders(Values(probe, RULES), lambda sentence: None)
        shaders.response(feed)
    return probe, shaders


def _repeated(response: Response, count: int) -> Response:
    return response.each(lambda array: np.repeat(array, count, axis=0))


def _triangle_means(raw: Response, count: int) -> Response:
    """Means (count rows) over the patches of each triangle."""

    def mean(array):
        if len(array) == 1:
            return np.repeat(array, count, axis=0)
        return array.reshape(count, len(PATCHES), -1).mean(axis=1)

    return raw.each(mean)


def even_emission(tree, rays: dict[str, float | None], *own) -> np.ndarray | None:
    """The emission (3,) of a lamp's or world's node tree, black without a feed, None when it varies with direction.

    ``rays`` is what a Light Path node tells there, ``own``, if given, what the light's object has (see Nowhere).
    """
    feed = output_feed(tree)
    if feed is None:
        return np.zeros(3)
    try:
        return Shaders(Values(Nowhere(rays, *own), RULES), lambda sentence: None).response(feed).emission[0]
    except WhereaboutsUnknown:
        return None
