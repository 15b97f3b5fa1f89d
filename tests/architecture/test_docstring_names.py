"""Every name that a docstring puts in backticks exists somewhere in the code."""

import ast
import builtins
import re
import sys
from pathlib import Path

import pytest

from replay.guide.pages import PAGES_FOLDER

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cdcore", "sessions", "replay")
IDENTIFIER = re.compile(r"[A-Za-z_]\w*")
QUOTED = re.compile(r"(?<![\w`])`{1,2}([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)(?:\(\))?`{1,2}(?![\w`])")
DATA_FILES = {".toml", ".html", ".css", ".csv", ".md"}
FOREIGN = {
    "CollisionResult",  # python-fcl
    "NUMBA_CACHE_DIR",  # numba
    "NarrowPhase",  # Rapier
    "OnCollisionEnter",  # Unity
    "OnCollisionExit",
    "OnCollisionStay",
    "ccd_tolerance",  # MuJoCo
    "except",  # a keyword of Python
    "fo",  # a statement of old OBJ files
    "orient2d",  # Shewchuk's predicate
    "proto",  # a file of the Rerun viewer
    "publish_time",  # MCAP
    "u624b",  # an escaped character
    "viewer_control",
}
"""Names of other programs and formats that no line of ours spells."""
EXAMPLES = {
    "LeftHand_2",
    "OBJECT_DESCRIPTOR_T001",
    "UCX_Beaker_03",
    "beaker_v2",
    "hull50",
    "left_wheel",
    "mesh50",
    "shipped50",
}
COMPOSED = {"UBX_", "UCP_", "USP_", "UTM_", "missed_largest", "missed_smallest"}
"""Names that the code puts together from two strings."""


NAMES_OF_NODE = {
    node: names
    for node in vars(ast).values()
    if isinstance(node, type)
    and (names := {"id", "attr", "arg", "name", "asname", "module"} & {*getattr(node, "_fields", ())})
}
"""Class of a node of the syntax tree -> its fields that hold an identifier."""


def docstring_nodes(tree):
    """Every string that stands alone as a statement: docstrings of modules, classes, functions and of names."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value


def text_of_code(tree):
    """Every identifier and every word of a string of a module, docstrings left out."""
    docstrings = {id(node) for node in docstring_nodes(tree)}
    for node in ast.walk(tree):
        for name in NAMES_OF_NODE.get(type(node), ()):
            value = getattr(node, name)
            if isinstance(value, str):
                yield from IDENTIFIER.findall(value)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield from IDENTIFIER.findall(node.value)


@pytest.fixture(scope="module")
def trees():
    """The syntax tree of every file of the packages: parsed once, in two seconds."""
    files = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return {path: ast.parse(path.read_text("utf-8")) for path in files}


@pytest.fixture(scope="module")
def known_words(trees):
    text = {*dir(builtins), *sys.stdlib_module_names}
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*"):
            text |= {path.stem, path.name}
            if path.suffix == ".py":
                text.update(text_of_code(trees[path]))
            elif path.suffix in DATA_FILES and path.is_file() and PAGES_FOLDER not in path.parents:
                text.update(IDENTIFIER.findall(path.read_text("utf-8")))
    text.update(IDENTIFIER.findall((ROOT / "pyproject.toml").read_text("utf-8")))
    return text


def test_names_in_docstrings_exist(known_words, trees):
    missing = []
    for path, tree in trees.items():
        for node in docstring_nodes(tree):
            for dotted in QUOTED.findall(node.value):
                if {*dotted.split(".")} - known_words - FOREIGN - EXAMPLES - COMPOSED:
                    missing.append(f"{path.relative_to(ROOT)}:{node.lineno}: {dotted}")
    assert not missing, "\n".join(missing)


PARAMETERS = re.compile(r"Parameters\n-+\n(.*?)(?=\n\n\w+\n-+|\Z)", re.DOTALL)
PARAMETER_LINE = re.compile(r"^(\w+(?:, \w+)*) :", re.MULTILINE)


def stale_parameters(tree):
    """Line and name of each parameter that a function's docstring describes and the function does not have."""
    for node in ast.walk(tree):
        section = PARAMETERS.search(ast.get_docstring(node) or "") if isinstance(node, ast.FunctionDef) else None
        if section is None:
            continue
        names = {argument.arg for argument in ast.walk(node.args) if isinstance(argument, ast.arg)}
        for line in PARAMETER_LINE.findall(section[1]):
            yield from ((node.lineno, name) for name in line.split(", ") if name not in names)


def test_documented_parameters_exist_in_the_signature(trees):
    planted = 'def f(a, **options):\n    """Do it.\n\n    Parameters\n    ----------\n    a, b : both.\n    """'
    assert [*stale_parameters(ast.parse(planted))] == [(1, "b")]
    stale = [f"{path.relative_to(ROOT)}: {fault}" for path, tree in trees.items() for fault in stale_parameters(tree)]
    assert stale == []
