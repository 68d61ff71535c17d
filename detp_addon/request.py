"""What a bake is asked to do."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..core.errors import InvalidSettingError
from ..core.settings import BakeSettings
from .reading.read_scene import FITS
from .writing.baked_layers import parts_of
from .writing.element_values import QUANTITIES
from .writing.encoding import Encoding
from .writing.write_attributes import check_attribute_name

#: where the colours live: each face's own light, or one colour per vertex
DOMAINS = ("CORNER", "POINT")


@dataclass(frozen=True)
class BakeRequest:
    """What to bake, how, and where to put it.

    targets    "visible" (all meshes that a render shows), "selected", or the objects' names
    attribute  name of the colour attribute
    domain     one of DOMAINS
    fit        "faces": colours such that faces show their light between them; "vertices": the light at the vertices
    quantity   one of element_values.QUANTITIES
    split      direct and indirect light also in attributes of their own, <attribute>_direct and <attribute>_indirect
    by_light   the light of each light group also in an attribute of its own, which add up to the whole
    activate   make the attribute the one that viewport and render show
    encoding   how the light becomes the attribute's numbers
    look       beside it, a layer with what the surfaces look like in the light, which the viewport shows
    cluster    the address of a Dask scheduler whose workers do the heavy work; "local": a process for each processor of
               this machine; None: these where it pays
    beside     how many bakes share this machine's processors

    Raises InvalidSettingError on anything else.
    """

    settings: BakeSettings = field(default_factory=BakeSettings)
    targets: str | tuple[str, ...] = "visible"
    attribute: str = "irradiance"
    domain: str = "CORNER"
    fit: str = "faces"
    quantity: str = "lighting"
    split: bool = False
    by_light: bool = False
    activate: bool = True
    encoding: Encoding = field(default_factory=Encoding)
    look: bool = False
    cluster: str | None = None
    beside: int = 1

    def __post_init__(self):
        for name in self.attributes:
            check_attribute_name(name)
        if isinstance(self.targets, str) and self.targets not in ("visible", "selected"):
            raise InvalidSettingError(f"Unknown choice '{self.targets}': bake what is visible, selected or named.")
        if self.domain not in DOMAINS:
            raise InvalidSettingError(f"Unknown domain '{self.domain}': choose {', '.join(DOMAINS)}.")
        if self.fit not in FITS:
            raise InvalidSettingError(f"Unknown choice '{self.fit}': fit the colours to {' or '.join(FITS)}.")
        if self.quantity not in QUANTITIES:
            raise InvalidSettingError(f"Unknown quantity '{self.quantity}': choose {', '.join(QUANTITIES)}.")
        if self.split and self.quantity == "ambient-occlusion":
            raise InvalidSettingError("Ambient occlusion has no direct and indirect part: leave the split away.")
        if self.by_light and self.quantity == "ambient-occlusion":
            raise InvalidSettingError("Ambient occlusion needs no lights, so it cannot be baked by light.")

    @property
    def attributes(self) -> tuple[str, ...]:
        """The names of all attributes that are written."""
        return (self.attribute, *(parts_of(self.attribute) if self.split else ()))
