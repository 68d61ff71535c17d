"""What pip installs is all there is."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]


def test_every_folder_of_code_is_installed():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    folders = [
        path.parent.relative_to(ROOT).parts
        for name in ("core", "detp_addon")
        for path in (ROOT / name).rglob("__init__.py")
    ]
    assert sorted(listed) == sorted(["detp", *(".".join(("detp", *parts)) for parts in folders)])


def test_pages_name_files_that_there_are():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    named = {
        (page.name, name)
        for page in pages
        for name in re.findall(r"\b(?:core|detp_addon|tests|tools)/[\w/]+\.py", page.read_text())
    }
    assert len(named) > 50 and [pair for pair in sorted(named) if not (ROOT / pair[1]).exists()] == []


def readme_example():
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    return code


def test_the_example_of_the_readme_finds_the_same_light_by_both_gatherers(capsys):
    held = {}
    exec(readme_example(), held)
    light, error = held["found"].irradiance, held["found"].standard_error
    # The lamp hangs 1 m above the middle, E = P cos / (4 pi r^2); the wall reflects the rest.
    direct = 10 / (4 * np.pi) / (1 + 2 * 0.9**2) ** 1.5
    assert (light[:2] > direct).all() and (light[2:] > light[:2] + 3 * error[2:]).all()
    by_index, by_cache = capsys.readouterr().out.splitlines()
    assert by_index.removeprefix("disc-index") == by_cache.removeprefix("sphere-cache")


def test_the_core_needs_no_blender_and_loads_embree_when_it_is_asked_to():
    check = "import sys; import detp.core; assert 'embreex' not in sys.modules; from detp.core import baked; "
    check += "assert 'embreex' in sys.modules and 'bpy' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", check]).returncode == 0


def test_a_command_that_needs_blender_says_so_without_it():
    call = "from detp.detp_addon.command.command import main; "
    call += f"sys.exit(main(['bake', {str(ROOT / 'sample_blends' / 'tree.blend')!r}, '-o', 'nowhere.blend']))"
    done = subprocess.run(
        [sys.executable, "-c", "import sys; sys.modules['bpy'] = None; " + call], capture_output=True, text=True
    )
    assert done.returncode == 1 and "pip install" in done.stderr.splitlines()[-1]
