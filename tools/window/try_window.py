"""Installs the extension into a fresh Blender and tries its panel in the real window, on a virtual screen.

    python tools/window/try_window.py [--archive FILE.zip] [--pictures FOLDER] [SCENE.blend] [TRY ...]

Needs Blender 4.2 or newer and xvfb-run on the PATH (and scrot, for the pictures); where they are missing it says so and
ends well, since most machines that test have no window. Without --archive the extension is built first. The user's own
settings of Blender are not touched. What is tried, and how, is in try_panel.py.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "sample_blends" / "cornell_box.blend"
SCREEN = "-screen 0 1600x1000x24"
NEEDED = ("blender", "xvfb-run", "scrot")

#: seconds that installing, and all tries together, may take
INSTALLING, TRYING = 120, 1800


def main() -> int:
    arguments = parse()
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        print(f"SKIPPED: Blender's window was NOT tried, since there is no {', no '.join(missing)} on the PATH.")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        archive = arguments.archive or built(Path(folder))
        environment = os.environ | {"BLENDER_USER_RESOURCES": folder, "DETP_SCREENSHOT": "scrot -o"}
        for name in ("config", "scripts", "extensions", "datafiles"):
            Path(folder, name).mkdir()  # Blender takes the user's own for each that is missing
        install = ["blender", "--command", "extension", "install-file", "--repo", "user_default", "--enable", archive]
        subprocess.run(install, env=environment, check=True, timeout=INSTALLING)
        blender = ["blender", "--gpu-backend", "opengl", "--enable-event-simulate", "--window-geometry", "0", "0"]
        blender += ["1600", "1000", arguments.scene, "--python-exit-code", "1"]
        blender += ["--python", Path(__file__).with_name("try_panel.py")]
        tries = ["--", arguments.pictures.resolve(), *arguments.tries]
        command = ["xvfb-run", "--auto-servernum", "--server-args", SCREEN, *blender, *tries]
        done = subprocess.run([str(part) for part in command], env=environment, timeout=TRYING)
    print("The window was tried: all went well." if done.returncode == 0 else "FAILED: see above.")
    return done.returncode


def built(folder: Path) -> Path:
    """The extension of this platform, made into ``folder``."""
    builder = ROOT / "tools" / "build_extension.py"
    subprocess.run([sys.executable, builder, "--output-dir", folder / "built"], check=True)
    [archive] = (folder / "built").glob("*.zip")
    return archive


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", type=Path, default=SCENE)
    parser.add_argument("tries", nargs="*", help="only these")
    parser.add_argument("--archive", type=Path, help="the extension, built already")
    parser.add_argument("--pictures", type=Path, default=ROOT / "build" / "window")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
