"""What a developer can turn in an engine, in the engine's own words; each row is a setting of a detector here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from replay.errors import TradeoffError
from replay.pipeline.gates import figure

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Choice:
    """One row: what is changed beside the first row (knob -> value), and the detector that answers for it."""

    knobs: Mapping[str, str]
    setting: str


@dataclass(frozen=True)
class Engine:
    """An engine as a new project has it (the first choice), and changes of it; ``source``: where its words are from."""

    name: str
    source: str
    choices: tuple[Choice, ...]
    notes: tuple[str, ...] = ()


STEP, COLLIDER, OFFSET = "Fixed Timestep", "Mesh Collider", "Default Contact Offset"
MODE, TRIGGER = "Collision Detection", "Is Trigger"
TICK, SIMPLE, CCD = "Async Fixed Time Step Size", "Collision Complexity", "Use CCD"

ENGINES: Final[dict[str, Engine]] = {
    "unity": Engine(
        "Unity 6000.0",
        "docs.unity3d.com/6000.0/Documentation/Manual: class-MeshCollider, class-PhysicsManager, class-TimeManager",
        (
            Choice({STEP: "0.02", MODE: "Discrete", COLLIDER: "Convex", OFFSET: "0.01", TRIGGER: "off"},
                   "collider[shape=hull,rate_hz=50,skin_m=0.01]"),
            Choice({STEP: "0.0111"}, "collider[shape=hull,rate_hz=90,skin_m=0.01]"),
            Choice({OFFSET: "0.001"}, "collider[shape=hull,rate_hz=50,skin_m=0.001]"),
            Choice({TRIGGER: "on"}, "collider[shape=hull,rate_hz=50]"),
            Choice({COLLIDER: "16 Convex pieces"}, "collider[shape=compound,rate_hz=50,skin_m=0.01]"),
            Choice({COLLIDER: "those recorded"}, "collider[shape=shipped,rate_hz=50,skin_m=0.01]"),
            Choice({COLLIDER: "16 Convex pieces", TRIGGER: "on"}, "collider[shape=compound,rate_hz=50]"),
            Choice({COLLIDER: "16 Convex pieces", TRIGGER: "on", STEP: "0.0111"},
                   "collider[shape=compound,rate_hz=90]"),
        ),
        ("Two meshes with Convex off never meet in Unity, so no row asks that.",),
    ),
    "unreal": Engine(
        "Unreal Engine 5",
        "dev.epicgames.com/documentation/en-us/unreal-engine: physics-settings, simple-versus-complex-collision",
        (
            Choice({TICK: "off, 90 frames a second", SIMPLE: "simple, Hull Count 1", CCD: "off"},
                   "collider[shape=hull,rate_hz=90]"),
            Choice({TICK: "0.0333"}, "collider[shape=hull,rate_hz=30]"),
            Choice({SIMPLE: "simple, Hull Count 16"}, "collider[shape=compound,rate_hz=90]"),
            Choice({SIMPLE: "simple, those recorded"}, "collider[shape=shipped,rate_hz=90]"),
            Choice({SIMPLE: "simple, Hull Count 16", TICK: "0.0333"}, "collider[shape=compound,rate_hz=30]"),
        ),
        ("Two bodies that use their complex collision as simple never meet in Unreal, so no row asks that.",),
    ),
    "mujoco": Engine(
        "MuJoCo 3",
        "mujoco.readthedocs.io/en/stable: XMLreference (option timestep, geom margin), computation (collision)",
        (
            Choice({"timestep": "0.002", "geom": "mesh, its hull", "margin": "0"}, "mujoco[rate_hz=500]"),
            Choice({"timestep": "0.02"}, "mujoco[rate_hz=50]"),
            Choice({"margin": "0.001"}, "mujoco[rate_hz=500,margin_m=0.002]"),
            Choice({"geom": "16 convex meshes"}, "collider[shape=compound,rate_hz=500]"),
            Choice({"geom": "those recorded"}, "collider[shape=shipped,rate_hz=500]"),
            Choice({"geom": "sdf"}, "collider[shape=mesh,rate_hz=500]"),
            Choice({"geom": "fitted capsule"}, "collider[shape=capsule,rate_hz=500]"),
            Choice({"geom": "16 convex meshes", "timestep": "0.02"}, "collider[shape=compound,rate_hz=50]"),
            Choice({"geom": "sdf", "timestep": "0.02"}, "collider[shape=mesh,rate_hz=50]"),
        ),
        ("MuJoCo adds the margins of both geoms; it has no continuous detection.",),
    ),
}  # fmt: skip
"""Name on the command line -> the engine."""

SHIPPED: Final = "shape=shipped"
"""What of a setting needs colliders in the recording."""

EXTRA: Final = {"shape=compound": "coacd", "mujoco[": "mujoco"}
"""What of a setting needs a module of the extra ``engines``."""


def engine_named(name: str) -> Engine:
    """The engine of that name; TradeoffError with the names there are."""
    if name not in ENGINES:
        raise TradeoffError(f"no engine {name!r}; there are: {', '.join(ENGINES)}")
    return ENGINES[name]


def knob_words(knobs: Mapping[str, str]) -> str:
    """``Fixed Timestep 0.02, Mesh Collider Convex``."""
    return ", ".join(f"{knob} {value}" for knob, value in knobs.items())


def advice_words(engine: str, rows: Sequence[Row]) -> list[str]:
    """What the first row misses and invents, and the smallest change that mends each; ``rows`` are of one session.

    The smallest change turns the fewest knobs; of several such rows the one with least false contact is taken.
    """
    first, *others = rows
    if not first["contacts"]:
        missed = f"The oracle finds no contact in this session, so none for {engine} to miss."
    elif _mended(first):
        missed = f"Nothing is missed in row 1: it finds each of {_contacts(first)}."
    else:
        mending = [row for row in others if _mended(row)]
        remedy = "No row finds every contact whole."
        if mending:
            remedy = f"The smallest change that finds every contact whole: {_change(_smallest(mending))}."
        missed = f"Row 1: {first['words']}. {remedy}"
    return [missed, *_false(first, others)]


def _contacts(row: Row) -> str:
    return f"{row['contacts']} contact" + "s" * (row["contacts"] != 1)


def _mended(row: Row) -> bool:
    """Every contact was found, in every frame, and none left undecided."""
    return not any(row[key] for key in ("missed", "in_part", "undecided", "undecided_in_part"))


def _smallest(rows: Sequence[Row]) -> Row:
    return min(rows, key=lambda row: (len(row["knobs"]), row["false"] or 0.0, row["number"]))


def _change(row: Row) -> str:
    return f"row {row['number']} ({knob_words(row['knobs'])})"


def _false(first: Row, others: Sequence[Row]) -> list[str]:
    """How much of the first row's contact is false, and the smallest change that makes it less and misses no more."""
    if not first["false"]:
        return []
    lost = [(row["missed"], row["in_part"]) for row in (first, *others)]
    better = [row for row, now in zip(others, lost[1:], strict=True) if now <= lost[0] and row["false"] is not None]
    less = [row for row in better if row["false"] <= first["false"] / 2]
    share = f"{figure(100 * first['false'])} % of the contact time that row 1 reports is false."
    if not less:
        return [f"{share} No row halves that without missing more."]
    best = _smallest(less)
    return [f"{share} The smallest change that halves that and misses no more: {_change(best)}, "
            f"{figure(100 * best['false'])} %."]  # fmt: skip
