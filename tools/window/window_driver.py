"""Plays a user in Blender's real window: moves the pointer, clicks, presses keys, takes pictures.

Blender must have been started with --enable-event-simulate, which puts these events where the window system's own
would arrive. A script is a generator: between two ``yield`` Blender handles events and draws; ``yield 0.5`` waits.
"""

import os
import subprocess
import sys
import time
import traceback
from contextlib import suppress

import bpy

#: pixels between two places of the pointer when a button is looked for
STEP = 8

#: the keys of characters that do not name theirs
KEYS = {" ": "SPACE", ".": "PERIOD", "0": "ZERO", "1": "ONE", "2": "TWO"}

FULL = {"full_path": True}

#: where the pointer is
_pointer = 0, 0


def window():
    """The window to act in: the first."""
    return bpy.context.window_manager.windows[0]


def area(kind="VIEW_3D"):
    """The largest area of a kind."""
    found = [area for area in window().screen.areas if area.type == kind]
    return max(found, key=lambda area: area.width * area.height)


def panels(kind="VIEW_3D"):
    """Its region of panels: of a 3D View the sidebar."""
    wanted = "UI" if kind == "VIEW_3D" else "WINDOW"
    return next(region for region in area(kind).regions if region.type == wanted)


def show_sidebar(tab):
    """Open the sidebar on a tab; a tab is known only once the sidebar has been drawn."""
    area().spaces[0].show_region_ui = True
    for _ in range(50):
        yield 0.1
        try:
            panels().active_panel_category = tab
        except (TypeError, AttributeError):
            area().tag_redraw()
        else:
            yield 0.3
            return
    raise RuntimeError(f"the sidebar has no tab {tab}")


def move(x, y):
    """Move the pointer, in pixels from the window's lower left corner."""
    global _pointer
    _pointer = int(x), int(y)
    _event("MOUSEMOVE", "NOTHING")


def click(x, y):
    """Move the pointer and press the left button."""
    move(x, y)
    yield 0.2
    yield from press_key("LEFTMOUSE")


def key(name, kind="VIEW_3D", **modifiers):
    """Press a key over the middle of an area."""
    over = area(kind)
    move(over.x + over.width // 3, over.y + over.height // 2)
    yield 0.1
    yield from press_key(name, **modifiers)


def press_key(name, **more):
    """Press a key, or a button of the mouse, where the pointer is."""
    _event(name, "PRESS", **more)
    yield 0.05
    _event(name, "RELEASE", **{name: value for name, value in more.items() if name != "unicode"})
    yield 0.05


def write(text, then=()):
    """Type a text of small letters, digits and a few signs, do what comes ``then``, and press Return."""
    for character in text:
        yield from press_key(KEYS.get(character, character.upper()), unicode=character)
    yield 0.3
    yield from then
    yield from press_key("RET")
    yield 0.2


def _event(name, value, **more):
    x, y = _pointer
    window().event_simulate(type=name, value=value, x=x, y=y, **more)


def hovered(kind="VIEW_3D"):
    """The operator call, or the property's full path, of the button under the pointer; or an empty text."""
    there = {"window": window(), "screen": window().screen, "area": area(kind), "region": panels(kind)}
    with bpy.context.temp_override(**there):
        for copy, how in ((bpy.ops.ui.copy_python_command_button, {}), (bpy.ops.ui.copy_data_path_button, FULL)):
            bpy.context.window_manager.clipboard = ""
            if copy.poll():
                with suppress(RuntimeError):
                    copy(**how)
            if bpy.context.window_manager.clipboard:
                return bpy.context.window_manager.clipboard
    return ""


def find(what, below=None, kind="VIEW_3D", across=0.65):
    """Where the button for an operator, or a property such as ``detp.quality``, is among an area's panels: move the
    pointer down, from the top or from ``below`` that height, at that share of their width, until it is over it."""
    region = panels(kind)
    x, hits = region.x + region.width * across, []
    # Until Blender has seen the pointer leave, the last button counts as under it.
    move(region.x - 50, region.y + region.height // 2)
    yield 0.3
    for y in range(below or region.y + region.height - 4, region.y + 4, -STEP):
        move(x, y)
        yield 0.05
        if _is_over(what, kind):
            hits.append(y)
        elif hits:
            break
    if not hits:
        raise RuntimeError(f"no button for {what} can be seen")
    y = (hits[0] + hits[-1]) // 2
    # A busy Blender may still have been drawing the pointer's last place.
    move(x, y)
    yield 0.3
    if not _is_over(what, kind):
        return (yield from find(what, below, kind, across))
    return x, y


def _is_over(what, kind):
    found = hovered(kind)
    return f"{what}(" in found or found.endswith(f".{what}")


def press(what, below=None, across=0.65):
    """Find a button and click it; returns its height in the window."""
    x, y = yield from find(what, below, across=across)
    yield from click(x, y)
    return y


def choose(what, letter):
    """Open the list of a property and take the entry whose name has that letter underlined."""
    yield from press(what)
    yield 0.3
    yield from press_key(letter.upper(), unicode=letter)
    yield 0.3


def enter(what, text):
    """Write into a field."""
    x, y = yield from find(what)
    yield from click(x, y)
    yield from click(x, y)
    yield 0.2
    yield from press_key("A", ctrl=True)
    yield from write(text)


def wait_for(condition, seconds=60.0):
    """Let Blender go on until ``condition()`` holds."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"waited {seconds:g} s in vain")
        yield 0.05


def picture(path):
    """Save what the window shows, by the command DETP_SCREENSHOT if there is one, else by Blender."""
    for area in window().screen.areas:
        area.tag_redraw()
    yield 0.4
    command = os.environ.get("DETP_SCREENSHOT")
    if command:
        subprocess.run([*command.split(), os.path.abspath(path)], check=True)
        return
    with bpy.context.temp_override(window=window(), screen=window().screen):
        bpy.ops.screen.screenshot(filepath=os.path.abspath(path))


def play(script):
    """Run the generator ``script`` in the window, then quit: status 0, or 1 with a traceback when it raised."""
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.use_preferences_save = False

    def tick():
        start = time.monotonic()
        try:
            with bpy.context.temp_override(window=window(), screen=window().screen):
                pause = next(script)
        except StopIteration:
            print("All of it worked.", flush=True)
            with bpy.context.temp_override(window=window(), screen=window().screen):
                bpy.ops.wm.quit_blender("EXEC_DEFAULT")
            return None
        except BaseException:
            traceback.print_exc()
            sys.stdout.flush()
            os._exit(1)  # Blender would go on, and quit_blender() always says 0
        # Blender counts the pause from the start of the step.
        return time.monotonic() - start + (pause or 0.05)

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
