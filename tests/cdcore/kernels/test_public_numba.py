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


def sources():
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


def private_names(text):
    """Names of numba's that a source uses and that numba's documentation does not list."""
    tree = ast.parse(text)
    found = [name for name in imports_of_numba(tree) if name not in PUBLIC]
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__"):
            owner = ast.unparse(node.value)
            found += [ast.unparse(node)] * (owner not in {"self", "cls"})
        if isinstance(node, ast.Attribute) and ast.unparse(node).startswith("numba.core"):
            found.append(ast.unparse(node))
        if isinstance(node, ast.Constant) and node.value == "pipeline_class":
            found.append(node.value)
    return found


def test_no_source_names_private_parts_of_numba():
    """All files of the packages that import numba, ``compiling.py`` among them."""
    named = sources()
    assert "cdcore/kernels/compiling.py" in named
    found = {name: private_names((ROOT / name).read_text()) for name in named}
    assert {name: names for name, names in found.items() if names} == {}


def test_the_option_without_reference_counts_is_documented():
    """``_nrt`` looks private, but numba's documentation of ``register_jitable`` names it."""
    assert "_nrt=False" in register_jitable.__doc__


@pytest.mark.parametrize(
    "line",
    [
        "from numba.core.lowering import Lower",
        "import numba.core.codegen",
        "from numba.core import cgutils",
        "from numba import _dispatcher",
        "compiled._cache.load_overload = patched",
        "numba.core.config.CACHE_DIR = folder",
        "options = {'pipeline_class': Compiler}",
    ],
)
def test_a_private_name_is_found(line):
    """Each line imports, names or sets something that numba does not document."""
    assert private_names(line)
