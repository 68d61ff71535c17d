"""Plays a user in Blender's real window: moves the pointer, clicks, presses keys, takes pictures.

Blender must have been started with --enable-event-simulate, which puts these events where the window system's own
would arrive. A script is a generator: between two ``yield`` Blender handles events and draws; ``yield 0.5`` waits.
"""

import os
import subprocess
import sys
import time
import traceback

import bpy

#: pixels between two places of the pointer when a button is looked for
STEP = 8


def window():
    """The window to act in: the first."""
    return bpy.context.window_manager.windows[0]


def view_area():
    """The largest 3D View."""
    views = [area for area in window().screen.areas if area.type == "VIEW_3D"]
    return max(views, key=lambda area: area.width * area.height)


def sidebar():
    """The sidebar's region of the 3D View."""
    return next(region for region in view_area().regions if region.type == "UI")


def show_sidebar(tab):
    """Open the sidebar on a tab; a tab is known only once the sidebar has been drawn."""
    view_area().spaces[0].show_region_ui = True
    for _ in range(50):
        yield 0.1
        try:
            sidebar().active_panel_category = tab
        except (TypeError, AttributeError):
            view_area().tag_redraw()
        else:
            yield 0.3
            return
    raise RuntimeError(f"the sidebar has no tab {tab}")


def move(x, y):
    """Move the pointer, in pixels from the window's lower left corner."""
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))


def click(x, y):
    """Move the pointer and press the left button."""
    move(x, y)
    yield 0.2
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type="LEFTMOUSE", value=value, x=int(x), y=int(y))
        yield 0.05


def key(name, **modifiers):
    """Press a key over the middle of the 3D View."""
    area = view_area()
    x, y = area.x + area.width // 3, area.y + area.height // 2
    move(x, y)
    yield 0.1
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type=name, value=value, x=x, y=y, **modifiers)
        yield 0.05


def hovered():
    """The operator call of the sidebar's button under the pointer, or an empty text."""
    with bpy.context.temp_override(window=window(), screen=window().screen, area=view_area(), region=sidebar()):
        if not bpy.ops.ui.copy_python_command_button.poll():
            return ""
        bpy.context.window_manager.clipboard = ""
        try:
            bpy.ops.ui.copy_python_command_button()
        except RuntimeError:
            return ""
        return bpy.context.window_manager.clipboard


def find(operator, below=None, across=0.65):
    """Where the sidebar's button for ``operator`` is: move the pointer down, from the top or from ``below`` that
    height, ``across`` the sidebar by that share of its width, until it is over it."""
    region = sidebar()
    x, hits = region.x + region.width * across, []
    # Until Blender has seen the pointer leave, the last button counts as under it.
    move(region.x - 50, region.y + region.height // 2)
    yield 0.3
    for y in range(below or region.y + region.height - 4, region.y + 4, -STEP):
        move(x, y)
        yield 0.05
        if f"{operator}(" in hovered():
            hits.append(y)
        elif hits:
            break
    if not hits:
        raise RuntimeError(f"no button for {operator} can be seen")
    return x, (hits[0] + hits[-1]) // 2


def press(operator, below=None, across=0.65):
    """Find a button and click it; returns its height in the window."""
    x, y = yield from find(operator, below, across)
    yield from click(x, y)
    return y


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
