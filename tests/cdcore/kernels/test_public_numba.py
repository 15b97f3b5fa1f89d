"""Sources name what numba documents only: modules, attributes, options."""

import ast
import subprocess
from pathlib import Path

import pytest
from numba.extending import register_jitable

ROOT = Path(__file__).resolve().parents[3]
PUBLIC = {
    "numba",
    "numba.extending",
    "numba.core.event",  # the event API of numba's documentation
    "numba.core.errors",  # its errors, as the documentation of ``overload`` raises them
}
"""Modules whose names numba's documentation tells users to import."""


def sources_that_import_numba():
    """Files of the packages that import numba."""
    imports = r"^\s*(from|import) numba\b"
    packages = ("cdcore", "sessions", "replay")
    return subprocess.check_output(["git", "grep", "-lE", imports, "--", *packages], cwd=ROOT, text=True).split()


def imports_of_numba(tree):
    """Names that a parsed file imports from numba, each as a public name or as its module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "numba")
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "numba":
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield full if full in PUBLIC else node.module
                if alias.name.startswith("_"):
                    yield full


def begins_with_numba(node):
    """Whether an attribute is one of ``numba`` or of something in it, however deep."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return isinstance(node, ast.Name) and node.id == "numba"


def private_names(text):
    """Names of numba's that a source uses and that numba's documentation does not list."""
    tree = ast.parse(text)
    names = [name for name in imports_of_numba(tree) if name not in PUBLIC]
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__"):
            owner = ast.unparse(node.value)
            names += [ast.unparse(node)] * (owner not in {"self", "cls"})
        if begins_with_numba(node) and ast.unparse(node).startswith("numba.core"):
            names.append(ast.unparse(node))
        if isinstance(node, ast.Constant) and node.value == "pipeline_class":
            names.append(node.value)
    return names


def test_no_source_names_private_parts_of_numba():
    """All files of the packages that import numba, ``compiling.py`` among them."""
    sources = sources_that_import_numba()
    assert "cdcore/kernels/compiling.py" in sources
    private_by_source = {name: private_names((ROOT / name).read_text()) for name in sources}
    assert {name: names for name, names in private_by_source.items() if names} == {}


def test_the_option_without_reference_counts_is_documented():
    """``_nrt`` looks private, but numba's documentation of ``register_jitable`` names it."""
    assert "_nrt=False" in register_jitable.__doc__


@pytest.mark.parametrize(
    ("line", "private"),
    [
        ("from numba.core.lowering import Lower", ["numba.core.lowering"]),
        ("import numba.core.codegen", ["numba.core.codegen"]),
        ("from numba.core import cgutils", ["numba.core"]),
        ("from numba import _dispatcher", ["numba._dispatcher"]),
        ("compiled._cache.load_overload = patched", ["compiled._cache"]),
        ("numba.core.config.CACHE_DIR = folder", ["numba.core.config.CACHE_DIR", "numba.core.config", "numba.core"]),
        ("options = {'pipeline_class': Compiler}", ["pipeline_class"]),
    ],
)
def test_a_private_name_is_found(line, private):
    """Each line of source imports, names or sets something that numba does not document."""
    assert private_names(line) == private
