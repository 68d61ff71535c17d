"""What pip installs is all there is."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_every_folder_of_code_is_installed():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    folders = [
        path.parent.relative_to(ROOT).parts
        for name in ("core", "detp_addon")
        for path in (ROOT / name).rglob("__init__.py")
    ]
    assert sorted(listed) == sorted(["detp", *(".".join(("detp", *parts)) for parts in folders)])
