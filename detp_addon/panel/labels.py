"""Text in panels, whose labels neither wrap nor know units."""

import textwrap

import bpy

from ..wording import counted


def sentence(layout: bpy.types.UILayout, text: str, width: int, icon: str = "NONE") -> None:
    """A text in as many labels as it has lines of ``width`` characters."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for row, line in enumerate(textwrap.wrap(text, width) or [""]):
        column.label(text=line, icon=icon if row == 0 or icon == "NONE" else "BLANK1")


def line_length(context) -> int:
    """Characters that fit a line of the region beside an icon."""
    scale = context.preferences.system.ui_scale
    return max(20, int((context.region.width / scale - 70) / 6.2))


def length(metres: float, units: bpy.types.UnitSettings) -> str:
    """As Blender's own fields show it."""
    return bpy.utils.units.to_string(units.system, "LENGTH", metres, precision=3)


def number(value: int) -> str:
    """Digits in groups of three, millions short."""
    return counted(value, "").strip(" s")
