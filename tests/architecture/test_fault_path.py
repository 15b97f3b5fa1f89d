"""One missed contact passes through few functions, files and types on its way from the audit to the pages."""

import ast
import sys
from pathlib import Path

import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from replay.cli.main import main
from sessions import write_session

PACKAGE = Path(replay.__file__).parent
FORMER_SHAPES = {
    *("Fault", "Miss", "MissedStretch", "FalseContact", "Moment", "MomentPlace"),
    *("KeyMoment", "Answer", "Cut", "Causes", "Fix", "CloseUp"),
}
"""Types in which a miss once travelled."""

FIELDS = {"Fault", "Cause", "KeyMoment"}
"""A type with a field of one of these is a shape of a fault."""

RUN = {"RunResult"}
"""The whole run, which holds the faults of all detectors."""

MOST = {"functions": 40, "files": 14, "shapes": 4}
"""How many functions, files and types may receive a miss."""
DETECTOR = "slow=discrete[rate_hz=5]"
"""Samples five times a second, and misses both contacts of the session, 0.12 s long."""


def shapes_of(sources):
    """Names of the classes that hold a fault, a cause or a moment in a field, and of these three."""
    shapes = set(FIELDS - {"Cause"})
    for source in sources:
        if not any(name in source for name in FIELDS):
            continue
        classes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ClassDef)]
        for node in classes:
            fields = [field.annotation for field in node.body if isinstance(field, ast.AnnAssign)]
            names = {name.id for field in fields for name in ast.walk(field) if isinstance(name, ast.Name)}
            if names & FIELDS:
                shapes.add(node.name)
    return shapes - RUN


def shape_of(value, shapes, depth=0):
    """Name of the shape that a value is or holds; ``None``: no shape."""
    name = type(value).__name__
    if name in shapes:
        return name
    if isinstance(value, dict) and {"cause", "start"} <= value.keys():
        return "dict"
    if depth < 2 and isinstance(value, tuple | list | dict) and 0 < len(value) < 40:
        members = list(value.values() if isinstance(value, dict) else value)[:3]
        return next((shape for member in members if (shape := shape_of(member, shapes, depth + 1))), None)
    return None


def receivers(call, shapes):
    """Functions of the package that get a fault as an argument while something is called, and the shapes they get."""
    functions, seen = set(), set()

    def profile(frame, event, _):
        path = frame.f_code.co_filename
        if event != "call" or not path.startswith(str(PACKAGE)):
            return
        count = frame.f_code.co_argcount + frame.f_code.co_kwonlyargcount
        for name in frame.f_code.co_varnames[:count]:
            if shape := shape_of(frame.f_locals.get(name), shapes):
                functions.add((path, frame.f_code.co_qualname))
                seen.add(shape)
                return

    sys.setprofile(profile)
    try:
        call()
    finally:
        sys.setprofile(None)
    return functions, seen


def test_shapes_are_the_types_with_a_field_of_a_fault():
    """Class A has a field of a fault and B of causes, C of neither; Fault and KeyMoment are shapes themselves."""
    source = "class A:\n    fault: Fault | None\nclass B:\n    causes: Mapping[Cause, int]\nclass C:\n    text: str\n"
    assert shapes_of([source]) == {"A", "B", "Fault", "KeyMoment"}


def test_shapes_of_a_fault_are_listed_for_the_package():
    """The search for types that hold a fault or a cause finds three in the sources of ``replay`` that do."""
    assert shapes_of(path.read_text("utf-8") for path in PACKAGE.rglob("*.py")) >= {"Fault", "Causes", "Answer"}


@pytest.mark.slow
def test_a_miss_passes_through_few_functions_files_and_types(tmp_path):
    """``replay run`` of a session with two misses: functions of the package that get a miss as an argument.

    They, their files and the types in which it comes are no more than MOST, and some. A run before loads all modules.
    """
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)
    write_session(session, tmp_path / "s.mcap")
    replay.run(session, detectors=DETECTOR)
    shapes = shapes_of(path.read_text("utf-8") for path in PACKAGE.rglob("*.py")) | FORMER_SHAPES
    arguments = ["run", str(tmp_path / "s.mcap"), "--out", str(tmp_path / "run"), "--detectors", DETECTOR]
    functions, received_shapes = receivers(lambda: main(arguments), shapes)
    files = {path for path, _ in functions}
    counts = {"functions": len(functions), "files": len(files), "shapes": len(received_shapes)}
    for name, most in MOST.items():
        assert 0 < counts[name] <= most, (counts, sorted(functions), sorted(received_shapes))
