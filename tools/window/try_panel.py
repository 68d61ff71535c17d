"""Tries the add-on in Blender's real window, as a user would: clicks, keys, other files; and takes pictures.

With the extension installed and enabled, and a scene with at least two meshes, one light and a camera:

    blender --enable-event-simulate SCENE.blend --python tools/window/try_panel.py -- FOLDER [NAME...]

The pictures go to FOLDER; look at them. NAMEs choose among the tries: first those of a newcomer, then updates, then
interruptions.
The last one uninstalls the extension. Blender ends with status 0 when all went well, else with 1 and a traceback. The
scene file is not changed.

Without a graphics card Blender's pictures of itself are black: name another program in the environment variable
DETP_SCREENSHOT, such as "scrot -o", which is called with the picture's path.
"""

import os
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = HERE, os.path.join(HERE, "..", "..", "tests", "blender")
import first_use  # noqa: E402 - found by the lines above, as the others
import interruptions  # noqa: E402
import updates  # noqa: E402
import window_driver as user  # noqa: E402
from watching import FOLDER, NAMES, open_scene  # noqa: E402

TRIES = {
    name.removeprefix("try_"): each
    for module in (first_use, updates, interruptions)
    for name, each in vars(module).items()
    if name.startswith("try_")
}


def main():
    os.makedirs(FOLDER, exist_ok=True)
    for name in NAMES or TRIES:
        start = time.monotonic()
        print(f"Trying {name}", flush=True)
        if TRIES[name].__module__ != first_use.__name__:
            yield from open_scene()
        yield from TRIES[name]()
        print(f"{name} took {time.monotonic() - start:.0f} s", flush=True)


user.play(main())
