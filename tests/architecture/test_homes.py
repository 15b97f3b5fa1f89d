"""Every fact has one home: its users hold the home's object, and no second definition or literal of it exists."""

import ast
import importlib
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

HOMES = {
    "the headset's rate": "sessions.model.constants:HEADSET_HZ",
    "frames of a block": "sessions.model.constants:BLOCK_FRAMES",
    "the frame budget": "replay.base.constants:BUDGET_MS",
    "the budget's word in plots": "replay.base.constants:ONE_FRAME",
    "the budget's column": "replay.outputs.tradeoff_table:OVER_BUDGET",
    "frames held in memory": "replay.base.constants:HELD_FRAMES",
    "frames whose verdicts are processed together": "replay.base.constants:VERDICT_FRAMES",
    "the caveat below every result": "replay.base.constants:CAVEAT",
    "a teleport": "sessions.doctor.pose_spans:teleports",
    "the speed of no motion": "sessions.doctor.track_watch:SPEED_BOUND",
    "a gap": "sessions.doctor.timing:gap_rows",
    "the length of a gap": "sessions.doctor.timing:GAP_STEPS",
    "runs of a mask": "sessions.doctor.runs:runs",
    "runs of every column": "replay.comparison.episodes:column_runs",
    "spans of a mask": "replay.effects.spans:spans_of",
    "quaternion to matrix": "cdcore.transforms.rigid:rotation_from_quaternion",
    "matrix to quaternion": "sessions.geometry.rotations:quaternion_from_matrix",
    "quaternion product": "sessions.geometry.rotations:quaternion_product",
    "quaternion inverse": "sessions.geometry.rotations:quaternion_inverse",
    "turned vectors": "sessions.geometry.rotations:rotated",
    "the red of a miss": "replay.outputs.palette:MISSED",
    "the session decoded once": "replay.prepare.holding_poses:decoded_once",
    "Wilson's interval": "replay.base.wilson:wilson",
    "the share of what comes in clusters": "replay.base.wilson:share_of_clusters",
    "what intervals are over": "replay.base.wilson:OVER_CONTACTS",
    "numbers of numpy in JSON": "replay.effects.output:plain_value",
    "a part of a page": "replay.outputs.report.markup:page_section",
}
"""Fact -> module and name of its home."""


@cache
def trees():
    """Module name -> its syntax tree."""
    found = {}
    for package in ("cdcore", "sessions", "replay"):
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = ast.parse(path.read_text("utf-8"))
    return found


@cache
def nodes(tree):
    return [*ast.walk(tree)]


def of(tree, *kinds):
    return [node for node in nodes(tree) if isinstance(node, kinds)]


def definitions(tree):
    """Names that a module makes itself: functions and classes at any depth, assignments at its top."""
    names = [node.name for node in of(tree, ast.FunctionDef, ast.ClassDef)]
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names += [one.id for target in targets if target for one in ast.walk(target) if isinstance(one, ast.Name)]
    return names


def second_definitions(found):
    """``module: name`` of what is defined, perhaps with an underscore before it, outside its home."""
    home_of = {name: module for module, _, name in (home.partition(":") for home in HOMES.values())}
    return {
        f"{module}: {name}"
        for module, tree in found.items()
        for name in definitions(tree)
        if home_of.get(name.lstrip("_"), module) != module
    }


def is_number(node, *values):
    return isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value in values


def numbers(*values):
    return lambda tree: any(is_number(node, *values) for node in of(tree, ast.Constant))


def names_and_values(tree):
    """What is assigned, given as a default or passed by keyword, with its name."""
    for node in of(tree, ast.arguments, ast.keyword, ast.Assign, ast.AnnAssign):
        if isinstance(node, ast.arguments):
            plain = [*node.posonlyargs, *node.args]
            some = zip(plain[len(plain) - len(node.defaults) :], node.defaults, strict=True)
            named = zip(node.kwonlyargs, node.kw_defaults, strict=True)
            yield from ((arg.arg, value) for arg, value in [*some, *named])
        elif isinstance(node, ast.keyword):
            yield node.arg or "", node.value
        else:
            first = node.targets[0] if isinstance(node, ast.Assign) else node.target
            yield getattr(first, "id", getattr(first, "attr", "")), node.value


def a_rate_of_90(tree):
    named = any(re.search("hz|rate|fps", name.lower()) and is_number(to, 90) for name, to in names_and_values(tree))
    return named or any(isinstance(one.op, ast.Div) and is_number(one.right, 90) for one in of(tree, ast.BinOp))


def a_bound_of_motion(tree):
    bounds = (value for name, value in names_and_values(tree) if re.search("teleport|gap_step", name.lower()))
    return any(isinstance(value, ast.Constant) and isinstance(value.value, int | float) for value in bounds)


def text(pattern):
    """Whether a string that is no docstring, so perhaps a sentence that is printed, matches."""

    def matches(tree):
        prose = {id(node.value) for node in of(tree, ast.Expr)}
        words = (one.value for one in of(tree, ast.Constant) if isinstance(one.value, str) and id(one) not in prose)
        return any(re.search(pattern, word, re.IGNORECASE) for word in words)

    return matches


def the_red(tree):
    rows = (node.elts for node in of(tree, ast.Tuple, ast.List) if len(node.elts) >= 3)
    return any(all(map(is_number, row[:3], (255, 45, 85))) for row in rows)


def called(tree, name):
    return [node for node in of(tree, ast.Call) if getattr(node.func, "attr", getattr(node.func, "id", "")) == name]


def edges_of_a_mask(tree):
    return any("int8" in ast.unparse(node) for node in called(tree, "diff"))


def a_result(tree):
    return bool(called(tree, "RunResult"))


def a_matrix_of_a_quaternion(tree):
    entries = (one for one in of(tree, ast.BinOp) if isinstance(one.op, ast.Sub) and is_number(one.left, 1))
    squares = r"1(\.0)? - 2(\.0)? \* \((\w+) \* \3 \+ (\w+) \* \4\)"
    return any(re.fullmatch(squares, ast.unparse(one)) for one in entries)


RATES, FIGURES = "sessions.model.constants", "replay.base.constants"
COPIES = [
    (a_rate_of_90, [RATES]),
    (a_bound_of_motion, ["sessions.doctor"]),
    (numbers(16384), [RATES, "cdcore"]),
    (numbers(324_000, 65536), [FIGURES, "cdcore"]),
    (numbers(11.1, 11.11, 11.111, 0.0111), []),
    (text(r"\b90 Hz|\b11\.1\b"), []),
    (text(r"tracker noise \(|recorded poses and these"), [FIGURES]),
    (text("ff2d55|255, ?45, ?85"), []),
    (the_red, ["replay.outputs.palette"]),
    (edges_of_a_mask, ["sessions.doctor.runs"]),
    # The kernel repeats it, because it refuses a norm that is off before it writes.
    (a_matrix_of_a_quaternion, ["cdcore.transforms.rigid", "cdcore.transforms.rigid_kernels"]),
    (a_result, ["replay.pipeline.engine"]),
]
"""How a copy of a fact is recognised, and the modules or packages that may hold it."""


def copies(found):
    return [
        (module, row)
        for row, (is_copy, allowed) in enumerate(COPIES)
        for module, tree in found.items()
        if not any(f"{module}.".startswith(f"{home}.") for home in allowed) and is_copy(tree)
    ]


@cache
def imports():
    """Name -> who imports it, and from where."""
    found = {}
    for module, tree in trees().items():
        for row in of(tree, ast.ImportFrom):
            for alias in row.names:
                found.setdefault(alias.name, []).append((module, row.module))
    return found


@pytest.mark.parametrize("fact", HOMES)
def test_every_user_of_a_fact_holds_the_object_of_its_home(fact):
    home, _, name = HOMES[fact].partition(":")
    kept = getattr(importlib.import_module(home), name)
    users = 0
    for module, source in imports().get(name, ()):
        users += 1
        assert getattr(importlib.import_module(source), name) is kept, module
    users += sum(one.id == name and isinstance(one.ctx, ast.Load) for one in of(trees()[home], ast.Name))
    assert users, "nobody uses it"


def test_no_fact_is_defined_twice():
    assert second_definitions(trees()) == set()


def test_no_fact_is_copied_as_a_literal():
    assert copies(trees()) == []


def test_a_result_is_made_in_one_place():
    assert len(called(trees()["replay.pipeline.engine"], "RunResult")) == 1


@pytest.mark.parametrize(
    "planted",
    [
        "FRAMES_HZ = 90.0",
        "TELEPORT_SPEED: Final = 20.0",
        "def _gap_rows(stamps): ...",
        "def make(*, rate_hz: float = 90.0): ...",
        "times = count / 90",
        "BUDGETS = (1.0, 3.0, 11.1)",
        "label = 'one frame at 90 Hz'",
        "head = 'p99 ms (over 11.1)'",
        "for start in range(0, n, 65536): ...",
        "KEPT = 324_000",
        "BLOCK = 16384",
        "note = f'{x}: tracker noise (VIVE) is larger'",
        "RED = (255, 45, 85, 255)",
        "style = 'fill: #FF2D55'",
        "edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))",
        "done = RunResult(session=session)",
        "m = 1 - 2 * (y * y + z * z)",
        "def _rotated(q, v): ...",
        "def runs(mask): ...",
        "class Some:\n    def quaternion_from_matrix(self): ...",
        "CAVEAT = 'exact'",
    ],
)
def test_a_planted_copy_is_found(planted):
    found = {"replay.metrics.planted": ast.parse(planted)}
    assert copies(found) or second_definitions(found)
