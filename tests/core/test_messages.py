"""Every error and every warning is explained in docs/messages.md."""

import ast
import inspect
import re
from pathlib import Path

import pytest
from detp.core import errors

ROOT = Path(__file__).parents[2]
EXPLAINED = (ROOT / "docs" / "messages.md").read_text(encoding="utf-8")

#: lists of sentences for the user, to which modules append
LISTS = ("notes", "warnings", "doubts", "gone")


def words(node):
    """The text of a string as it is written, with {} where values come in; "" when it is none."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return ""


def warnings():
    """Of each warning the sentence, and where it stands: what is warned of, appended, or a list of its own."""
    for path in sorted((ROOT / "detp_addon").rglob("*.py")):
        if path.parent.name in ("tradeoff", "study"):
            continue  # they write reports of sentences
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.List, ast.ListComp)):
                for each in node.elts if isinstance(node, ast.List) else [node.elt]:
                    if words(each).endswith("."):
                        yield words(each), f"{path.name}:{node.lineno}"
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute) or not node.args:
                continue
            to = ast.unparse(node.func.value).rpartition(".")[2]
            if node.func.attr == "warn" or (node.func.attr == "append" and to in LISTS):
                yield words(node.args[0]), f"{path.name}:{node.lineno}"


@pytest.mark.parametrize("name", [name for name, each in inspect.getmembers(errors, inspect.isclass)])
def test_every_error_is_explained(name):
    assert name == "DetpError" or f"`{name}`" in EXPLAINED


def test_every_warning_is_explained():
    found = [(sentence, where) for sentence, where in warnings() if len(re.sub(r"{}|\W", "", sentence)) > 9]
    assert len(found) > 40
    assert [each for each in found if f"| {each[0]} |" not in EXPLAINED] == []
