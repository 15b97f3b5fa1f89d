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
"""Names that a user may give, or that are made of a user's number."""
COMPOSED = {"UBX_", "UCP_", "USP_", "UTM_", "missed_largest", "missed_smallest"}
"""Names that the code puts together from two strings."""


DOCSTRING = re.compile(r'^[ \t]*r?"""(.*?)"""', re.DOTALL | re.MULTILINE)
"""A string that begins a line: the docstring of a module, class, function or constant."""
COMMENT = re.compile(r"(?:^|\s)# .*")


@pytest.fixture(scope="module")
def sources():
    """Path -> text of every Python file of the packages."""
    return {path: path.read_text("utf-8") for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


@pytest.fixture(scope="module")
def names_of_code(sources):
    """Every word of code, strings and data files that is no docstring and no comment, and the names of all files."""
    names = {*dir(builtins), *sys.stdlib_module_names}
    for text in sources.values():
        names.update(IDENTIFIER.findall(COMMENT.sub("", DOCSTRING.sub("", text))))
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*"):
            names |= {path.stem, path.name}
            if path.suffix in DATA_FILES and path.is_file() and PAGES_FOLDER not in path.parents:
                names.update(IDENTIFIER.findall(path.read_text("utf-8")))
    names.update(IDENTIFIER.findall((ROOT / "pyproject.toml").read_text("utf-8")))
    return names


def unknown_names(text, known):
    """The names in backticks of all docstrings of a text that have a word which is not known."""
    quoted = [dotted for docstring in DOCSTRING.findall(text) for dotted in QUOTED.findall(docstring)]
    return [dotted for dotted in quoted if not {*dotted.split(".")} <= known]


def test_names_in_docstrings_exist(sources, names_of_code):
    """A name in backticks, in any docstring of the packages, is one of the code, or one of three lists of others."""
    known = names_of_code | FOREIGN | EXAMPLES | COMPOSED
    unknown = {str(path.relative_to(ROOT)): unknown_names(text, known) for path, text in sources.items()}
    assert {path: names for path, names in unknown.items() if names} == {}


def test_name_of_a_docstring_that_no_code_has_is_noticed():
    """A docstring has two names, of which only ``gone`` is known; a comment does not make the other a name of code."""
    source = 'def gone():\n    """See `gone` and ``gone.never_written``."""  # never_written\n'
    assert unknown_names(source, known={"gone"}) == ["gone.never_written"]


PARAMETERS = re.compile(r"Parameters\n-+\n(.*?)(?=\n\n\w+\n-+|\Z)", re.DOTALL)
PARAMETER_LINE = re.compile(r"^(\w+(?:, \w+)*) :", re.MULTILINE)


def functions_of(node):
    """Functions of a module or class, and those of its classes, but none within a function."""
    for statement in node.body:
        if isinstance(statement, ast.FunctionDef):
            yield statement
        elif isinstance(statement, ast.ClassDef):
            yield from functions_of(statement)


def stale_parameters(tree):
    """Line and name of each parameter that a function's docstring describes and the function does not have."""
    for node in functions_of(tree):
        section = PARAMETERS.search(ast.get_docstring(node) or "")
        if section is None:
            continue
        names = {argument.arg for argument in ast.walk(node.args) if isinstance(argument, ast.arg)}
        for line in PARAMETER_LINE.findall(section[1]):
            yield from ((node.lineno, name) for name in line.split(", ") if name not in names)


def test_documented_parameters_exist_in_the_signature(sources):
    """Each name in a section "Parameters", in more than 50 files, is a parameter of its function."""
    described = {
        path: text for path, text in sources.items() if re.search(r"^ +Parameters\n +-+\n", text, re.MULTILINE)
    }
    assert len(described) > 50
    trees = {path: ast.parse(text) for path, text in described.items()}
    stale = [f"{path.relative_to(ROOT)}: {fault}" for path, tree in trees.items() for fault in stale_parameters(tree)]
    assert stale == []


def test_documented_parameter_that_is_absent_is_noticed():
    """The docstring of f describes a and b; f has no b, which is reported with the line of the function, 1."""
    source = 'def f(a, **options):\n    """Do it.\n\n    Parameters\n    ----------\n    a, b : both.\n    """'
    assert [*stale_parameters(ast.parse(source))] == [(1, "b")]
