"""The three facades: every public name is there, typed, and the same function at every use."""

import ast
import os
import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cdcore", "sessions", "replay")


def homes(package):
    """Public name -> (module, name there), from the imports that only a type checker reads."""
    tree = ast.parse(Path(import_module(package).__file__).read_text("utf-8"))
    typed = next(node for node in tree.body if isinstance(node, ast.If))
    return {
        alias.asname or alias.name: (node.module, alias.name)
        for node in typed.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_lazy_package_exports_equal_its_typed_imports(package):
    """A package loads a public name when it is first used, from the module that its table ``_HOME`` says.

    Type checkers read the same names from imports under ``if TYPE_CHECKING``; each is the object of its module.
    """
    facade = import_module(package)
    assert set(facade.__all__) == set(facade._HOME) == set(homes(package)) == set(dir(facade))
    for name, (module, name_in_module) in homes(package).items():
        assert facade.__getattr__(name) is getattr(import_module(module), name_in_module), name


@pytest.mark.parametrize("package", PACKAGES)
def test_unknown_name_is_answered_with_existing_names(package):
    """No package has the name Mash: the error lists those that there are, the last public one among them."""
    facade = import_module(package)
    with pytest.raises(AttributeError, match=rf"'{package}' has no attribute 'Mash'; it has: .*{facade.__all__[-1]}"):
        _ = facade.Mash


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_ships_a_py_typed_marker(package):
    """Without the file a type checker ignores the package's types."""
    assert (ROOT / package / "py.typed").is_file()


@pytest.mark.parametrize("package", PACKAGES)
def test_no_submodule_has_the_name_of_an_exported_object(package):
    """A submodule would take the object's place once it is imported."""
    facade = import_module(package)
    submodules = {module.name for module in pkgutil.iter_modules(facade.__path__)}
    assert submodules and submodules.isdisjoint(facade.__all__)


TWICE = """
import pkgutil, replay
from importlib import import_module

for module in pkgutil.walk_packages(replay.__path__, "replay."):
    if not module.name.endswith("__main__"):
        import_module(module.name)

from sessions import parse_scene

session = replay.synthetic_session("fast-ball")[0]
for _ in range(2):
    assert replay.plan(parse_scene("")).effects == ()
    assert replay.run(session, oracle="none", detectors="sphere").detections
    assert replay.audit(session, detectors="sphere", oracle="exact").audit
    assert replay.tradeoff(session, time_limit=0.0).rows
    assert replay.stress("exact", families=(), pairs=1).tallies == ()
"""


@pytest.mark.slow
def test_every_verb_works_twice_after_importing_all_submodules():
    """A program imports all modules of ``replay`` and then calls plan, run, audit, tradeoff and stress, twice each.

    A submodule with the name of such a function would take its place once it is imported.
    """
    ended = subprocess.run([sys.executable, "-c", TWICE], capture_output=True, text=True, cwd=ROOT)
    assert ended.returncode == 0, ended.stderr[-3000:]


SCRIPT = """
from cdcore import TriangleMesh
from replay import audit, plan, run, stress, synthetic_session, tradeoff
from sessions import make_shape, read_session

session = read_session("a.mcap")
result = run(session)
wrong: int = result
reveal_type(result)
reveal_type(session)
reveal_type(audit(session).results)
reveal_type(plan(session.scene))
reveal_type(tradeoff(session).advice)
reveal_type(stress().tallies)
reveal_type(synthetic_session("titration")[0])
reveal_type(make_shape("box", {"x": 1.0, "y": 1.0, "z": 1.0}))
reveal_type(TriangleMesh([[0.0] * 3], [[0, 0, 0]]))
"""

REVEALED = ("RunResult", "Session", "RunResult", "Plan", "str", "Tally", "Session", "MeshData", "TriangleMesh")
"""The type that each ``reveal_type`` of SCRIPT prints, or is made of, in their order."""


@pytest.mark.slow
def test_a_type_checker_sees_the_types_of_a_users_script(tmp_path):
    """mypy reads SCRIPT, a user's, with one wrong assignment, which it must name and nothing else.

    It knows the types of REVEALED, none of which is Any.
    """
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, "utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(ROOT / "pyproject.toml")]
    ended = subprocess.run(
        [*command, str(script)], capture_output=True, text=True, cwd=ROOT, env=os.environ | {"MYPYPATH": str(ROOT)}
    )
    lines = [line for line in ended.stdout.splitlines() if "script.py" in line]
    (error,) = [line for line in lines if "error:" in line]
    assert "Incompatible types in assignment" in error, ended.stdout[-3000:]
    revealed = [line.partition("Revealed type is ")[2] for line in lines if "Revealed type" in line]
    for line, name in zip(revealed, REVEALED, strict=True):
        assert "Any" not in line and name in line, line
