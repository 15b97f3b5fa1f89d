"""What a developer can set in an engine, in the engine's own words; each row is a setting of a detector here.

Every row is a configuration that the engine accepts for bodies with meshes, and its pages were read: a mesh against a
mesh that the engine does not test is no row, and continuous detection is none where it is not made for meshes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from replay.errors import TradeoffError
from replay.pipeline.gates import figure
from replay.pipeline.sentences import plural
from replay.tradeoffs.pareto import count_words
from replay.tradeoffs.settings import FASTEST

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Choice:
    """One row: what is set beside the first row (knob -> value), and the detector that answers for it.

    ``pages`` are names of the engine's pages that say so; ``consequence``: what else comes of it, a sentence.
    """

    knobs: Mapping[str, str]
    detector: str
    settings: Mapping[str, Any]
    pages: tuple[str, ...]
    consequence: str = ""

    def asked(self, frames_hz: float) -> str:
        """What ``replay run --detectors`` takes; a step as fast as the recording sees every frame and has no rate."""
        fast = self.settings["rate_hz"] >= FASTEST * frames_hz
        kept = {key: value for key, value in self.settings.items() if key != "rate_hz" or not fast}
        words = ",".join(f"{key}={value}" for key, value in kept.items())
        return f"{self.detector}[{words}]" if words else self.detector


@dataclass(frozen=True)
class Engine:
    """An engine as a new project has it (the first choice), and changes of it.

    ``pages``: name -> address; ``step_hz``: of a new project.
    """

    name: str
    version: str
    pages: Mapping[str, str]
    choices: tuple[Choice, ...]
    notes: tuple[str, ...]
    step_hz: float = 50


STEP, COLLIDER, OFFSET, TRIGGER = "Fixed Timestep", "Mesh Collider", "Default Contact Offset", "Is Trigger"
TICK, SIMPLE = "Async Fixed Time Step Size", "Collision Complexity"
HULL: Final = {"shape": "compound", "pieces": 1}
PIECES: Final = {"shape": "compound", "pieces": 16}
SHIPPED_SHAPE: Final = {"shape": "shipped"}
NO_PUSH: Final = "A trigger reports but does not push."

ENGINES: Final[dict[str, Engine]] = {
    "unity": Engine(
        "Unity", "6000.1",
        {
            "mesh": "https://docs.unity3d.com/6000.1/Documentation/Manual/class-MeshCollider.html",
            "pairs": "https://docs.unity3d.com/6000.1/Documentation/Manual/collider-types-interaction.html",
            "physics": "https://docs.unity3d.com/6000.0/Documentation/Manual/class-PhysicsManager.html",
            "continuous": "https://docs.unity3d.com/6000.2/Documentation/Manual/ContinuousCollisionDetection.html",
            "time": "https://docs.unity3d.com/6000.2/Documentation/Manual/class-TimeManager.html",
        },
        (
            Choice({STEP: "0.02", COLLIDER: "Convex", OFFSET: "0.01", TRIGGER: "off"}, "collider",
                   {**HULL, "rate_hz": 50, "skin_m": 0.01}, ("mesh", "physics", "time")),
            Choice({STEP: "0.0111"}, "collider", {**HULL, "rate_hz": 90, "skin_m": 0.01}, ("time",)),
            Choice({OFFSET: "0.001"}, "collider", {**HULL, "rate_hz": 50, "skin_m": 0.001}, ("physics",)),
            Choice({TRIGGER: "on"}, "collider", {**HULL, "rate_hz": 50}, ("mesh", "pairs"), NO_PUSH),
            Choice({COLLIDER: "16 Convex", OFFSET: "0.001"}, "collider",
                   {**PIECES, "rate_hz": 50, "skin_m": 0.001}, ("mesh", "physics")),
            Choice({COLLIDER: "16 Convex", TRIGGER: "on"}, "collider", {**PIECES, "rate_hz": 50},
                   ("mesh", "pairs"), NO_PUSH),
            Choice({COLLIDER: "16 Convex", TRIGGER: "on", STEP: "0.0111"}, "collider", {**PIECES, "rate_hz": 90},
                   ("mesh", "pairs", "time"), f"{NO_PUSH} Physics runs 90 times a second, not 50."),
            Choice({COLLIDER: "those recorded", TRIGGER: "on"}, "collider", {**SHIPPED_SHAPE, "rate_hz": 50},
                   ("mesh", "pairs"), NO_PUSH),
        ),
        (
            "Two kinematic bodies send no OnCollision messages unless Contact Pairs Mode is Enable Kinematic Kinematic "
            "Pairs (or All); rows with Is Trigger off suppose that. Triggers send OnTrigger messages as they are.",
            "Two Mesh Colliders without Convex do not collide, and Continuous is made for boxes, spheres and capsules: "
            "no row asks either. A Convex one has at most 255 triangles, and so have these.",
        ),
    ),
    "unreal": Engine(
        "Unreal Engine", "5",
        {
            "complexity": "https://dev.epicgames.com/documentation/en-us/unreal-engine/"
                          "simple-versus-complex-collision-in-unreal-engine",
            "trace flag": "https://dev.epicgames.com/documentation/en-us/unreal-engine/python-api/class/"
                          "CollisionTraceFlag?application_version=5.1",
            "overview": "https://docs.unrealengine.com/4.27/en-US/InteractiveExperiences/Physics/Collision/Overview/",
        },
        (
            Choice({SIMPLE: "simple, one convex hull", TICK: "off, 90 frames a second"}, "collider",
                   {**HULL, "rate_hz": 90}, ("complexity", "overview")),
            Choice({TICK: "0.0333"}, "collider", {**HULL, "rate_hz": 30}, ("complexity",)),
            Choice({SIMPLE: "simple, 16 UCX_ hulls"}, "collider", {**PIECES, "rate_hz": 90}, ("complexity",)),
            Choice({SIMPLE: "simple, 16 UCX_ hulls", TICK: "0.0333"}, "collider", {**PIECES, "rate_hz": 30},
                   ("complexity",)),
            Choice({SIMPLE: "simple, those recorded"}, "collider", {**SHIPPED_SHAPE, "rate_hz": 90}, ("complexity",)),
        ),
        (
            "Bodies that a hand moves report with Generate Overlap Events on both. An overlap reports but does not "
            "block.",
            "Use Complex Collision As Simple is for static bodies that simulated simple ones hit; two bodies that use "
            "it do not meet, so no row asks that.",
        ),
        step_hz=90,
    ),
    "mujoco": Engine(
        "MuJoCo", "3",
        {
            "geom": "https://mujoco.readthedocs.io/en/stable/XMLreference.html#body-geom",
            "collision": "https://mujoco.readthedocs.io/en/stable/computation/index.html#collision-detection",
            "margin": "https://mujoco.readthedocs.io/en/stable/computation/index.html#margin-and-gap",
        },
        (
            Choice({"timestep": "0.002", "geom": "mesh, its hull", "margin": "0"}, "mujoco", {"rate_hz": 500},
                   ("geom", "collision")),
            Choice({"timestep": "0.02"}, "mujoco", {"rate_hz": 50}, ("geom",)),
            Choice({"margin": "0.001"}, "mujoco", {"rate_hz": 500, "margin_m": 0.002}, ("margin",)),
            Choice({"geom": "16 convex meshes"}, "collider", {**PIECES, "rate_hz": 500}, ("collision",)),
            Choice({"geom": "16 convex meshes", "timestep": "0.02"}, "collider", {**PIECES, "rate_hz": 50},
                   ("collision",)),
            Choice({"geom": "those recorded"}, "collider", {**SHIPPED_SHAPE, "rate_hz": 500}, ("collision",)),
        ),
        (
            "MuJoCo replaces a mesh geom by its hull, adds the margins of both geoms, and has no continuous detection.",
            "Two mocap bodies make no contact, being fixed to the world: give what a hand moves a free joint.",
        ),
        step_hz=500,
    ),
}  # fmt: skip
"""Name on the command line -> the engine. What the pages do not say of MuJoCo was measured with 3.17: margins of 0.01
list a contact at 0.019 and none at 0.021, and two mocap bodies that overlap have none."""


def engine_named(name: str) -> Engine:
    """The engine of that name; TradeoffError with the names there are."""
    if name not in ENGINES:
        raise TradeoffError(f"no engine {name!r}; there are: {', '.join(ENGINES)}")
    return ENGINES[name]


def lacking(choice: Choice) -> str:
    """The module of the extra ``engines`` that a row needs; ``""``: none."""
    if choice.detector == "mujoco":
        return "mujoco"
    return "coacd" if choice.settings.get("pieces", 1) > 1 else ""


def knob_words(knobs: Mapping[str, str]) -> str:
    """``Fixed Timestep 0.02, Mesh Collider Convex``."""
    return ", ".join(f"{knob} {value}" for knob, value in knobs.items())


def advice_words(engine: str, rows: Sequence[Row]) -> list[str]:
    """What the first row gets wrong, and the row that gets least wrong; ``rows`` are of one session.

    Of rows with equally few wrong contacts the one that turns the fewest knobs is taken.
    """
    first = rows[0]
    if not first["contacts"]:
        none = f"No contact happened, so none for {engine} to miss."
        return [none, "All that row 1 reports is false."] if first["false"] else [none]
    if not first["wrong"]:
        return [f"Row 1 gets each of {plural(first['contacts'], 'contact')} right."]
    best = min(rows, key=lambda row: (row["wrong"], len(row["knobs"]), row["false"] or 0.0, row["number"]))
    sentences = [f"Row {first['number']}: {wrong_words(first)}."]
    if best["wrong"] >= first["wrong"]:
        return [*sentences, "No row gets fewer contacts wrong."]
    cure = f"Take row {best['number']} ({knob_words(best['knobs'])}): {wrong_words(best)} (measured on this session)."
    return [*sentences, cure, *([best["consequence"]] if best["consequence"] else [])]


def wrong_words(row: Row) -> str:
    """``0-1 of 18 contacts missed, 1-3 late or cut short, 86 % of its contact time false``."""
    parts = [f"{count_words(row, 'missed')} of {plural(row['contacts'], 'contact')} missed"]
    parts.append(f"{count_words(row, 'late')} late or cut short")
    if row["undecided"]:
        parts.append(f"{row['undecided']} undecided")
    if row["false"] is not None:
        parts.append(f"{figure(100 * row['false'])} % of its contact time false")
    return ", ".join(parts)
