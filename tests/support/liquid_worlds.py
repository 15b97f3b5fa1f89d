"""Tilted glasses, and a scene with a table of every kind of effect."""

import subprocess
import sys
import tomllib
from copy import deepcopy
from pathlib import Path

import numpy as np
from support.small_worlds import STEP_NS, cube, unit_cubes_on_x

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.ledger_columns import ADDED_SUFFIX, HEAT_COLUMN, LATENT_HEAT_COLUMN, Warmth
from replay.effects.chemistry.matter import dilution_of
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.effect_plan import plan
from replay.engine import compute
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.session import HandTrack, Track

RADIUS, HEIGHT = 0.02, 0.06
"""Of the glass, which holds 75.4 mL."""


WIDE_BEAKER = {"radius": 0.05, "height": 0.08}
"""A beaker that holds 600 mL."""

WATER_J_PER_ML_K = 4.18

LOWER = 0.2
"""The receiving glass stands this far below the pouring one."""


def glass(name, volume_ml=0.0, *, cavity=None, properties=None, **liquid) -> SceneBody:
    """A cylindrical glass, its lip towards +X, with so much liquid and other properties."""
    sizes = {
        "capacity_ml": 50.0, "floor": 0.0, "mark": 50e-6 / (np.pi * RADIUS**2), "radius": RADIUS, "height": HEIGHT,
        "opening": [0.0, HEIGHT, 0.0], "opening_radius": RADIUS, "lip": [RADIUS, HEIGHT, 0.0],
    }  # fmt: skip
    reported = {"liquid": {"volume_ml": volume_ml, **liquid}, **(properties or {})}
    return SceneBody(name, extra={"cavity": sizes | (cavity or {}), "properties": reported})


def poses_of_tilted_glass(degrees, lip=(0.0, LOWER, 0.0)):
    """Poses of a glass tilted towards +X about its lip, which stays where it is.

    A tilt by some 50 degrees in one frame is a jump to the doctor: what it pours counts from the frame after.
    """
    half = -0.5 * np.radians(np.asarray(degrees, dtype=np.float64))
    rotations = np.zeros((len(half), 4))
    rotations[:, 2], rotations[:, 3] = np.sin(half), np.cos(half)
    c, s = np.cos(2 * half), np.sin(2 * half)
    reach = np.stack([c * RADIUS - s * HEIGHT, s * RADIUS + c * HEIGHT, np.zeros_like(c)], axis=1)
    return np.asarray(lip) - reach, rotations


def poses_at_rest(count, position=(0.0, 0.0, 0.0)):
    """Poses of a glass that stands."""
    return np.tile(np.asarray(position, dtype=np.float64), (count, 1)), np.tile((0.0, 0.0, 0.0, 1.0), (count, 1))


def session_with_effects(poses, bodies, *effects, valid=None, step_ns=STEP_NS) -> Session:
    """A session of these bodies with their poses, a frame every 10 ms; every mesh is a cube, for nobody looks at it."""
    count = len(next(iter(poses.values()))[0])
    scene = Scene(bodies=tuple(bodies), effects=tuple(SceneEffect(kind, reported) for kind, reported in effects))
    meshes = {name: cube(0.01) for name in poses}
    stamps = np.arange(count) * step_ns
    tracks = {name: Track(stamps, *pose, (valid or {}).get(name)) for name, pose in poses.items()}
    return Session.from_tracks(tracks, meshes, scene)


def effects_of_tilt_degrees(degrees, bodies=None, *more, position=(0.0, 0.0, 0.0), valid=None):
    """Effects of a run in which glass ``a`` is tilted over glass ``b`` by so many degrees, one a frame of 10 ms.

    Unless given, a holds 60 mL and b 10 mL of water. ``position``: of b, below the lip of a; ``more``: effects.
    """
    poses = {"a": poses_of_tilted_glass(degrees), "b": poses_at_rest(len(degrees), position)}
    effects = (("pour", {"from": ["a"], "into": ["b"]}), *more)
    return compute(
        session_with_effects(poses, bodies or (glass("a", 60.0), glass("b", 10.0)), *effects, valid=valid)
    ).effects


TAP = {  # of the glass burette, over the glass flask; at 90 degrees it is open
    "body": "burette",
    "joint": "tap",
    "into": ["flask"],
    "full_area_m2": 6e-7,
    "full_angle_deg": 90.0,
    "discharge": 0.6,
}
BURETTE_COLUMN = {"capacity_ml": 50.0, "floor": 0.15, "mark": 0.65}


def tap_rotations(degrees):
    """Poses of a tap turned about Z."""
    half = 0.5 * np.radians(np.asarray(degrees, dtype=np.float64))
    rotations = np.zeros((len(half), 4))
    rotations[:, 2], rotations[:, 3] = np.sin(half), np.cos(half)
    return np.tile((0.0, 0.25, 0.0), (len(half), 1)), rotations


def effects_of_tap_degrees(degrees, *more, burette=None, flask=None, settings=None, valid=None, step_ns=STEP_NS):
    """Effects of a run in which a burette's tap over a flask is opened by so many degrees, one a frame of 10 ms.

    Unless given, the burette holds 50 mL of NaOH and the flask 0.5 mL of HCl, each of 0.1 mol/L.
    """
    burette = burette or glass("burette", 50.0, solute="NaOH", molar=0.1, cavity=BURETTE_COLUMN)
    flask = flask or glass("flask", 0.5, solute="HCl", molar=0.1)
    count = len(degrees)
    poses = {
        "burette": poses_at_rest(count, (0.0, 0.15, 0.0)),
        "tap": tap_rotations(degrees),
        "flask": poses_at_rest(count),
    }
    effects = (("burette", {**TAP, **(settings or {})}), *more)
    return compute(
        session_with_effects(poses, (burette, flask, SceneBody("tap")), *effects, valid=valid, step_ns=step_ns)
    ).effects


MIXING_IN_FLASK = ("mixing", {"in": ["flask"]})
NEUTRALISATION = ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"})


ROOT = Path(__file__).resolve().parents[2]
SCENE = tomllib.loads((ROOT / "tests/replay/effects/every_effect.toml").read_text("utf-8"))
TABLES, HOLDS, WITH = SCENE["tables"], SCENE["holds"], SCENE["with"]
BODIES = {name: glass(name, 5.0, solutes=solutes).extra for name, solutes in HOLDS.items()}
BODIES["burette"]["cavity"] |= BURETTE_COLUMN
BODIES["flask"]["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.5}
BODIES["dish"] = SCENE["dish"]
BODIES |= {name: {} for name in ("tap", "tube", "lamp", "wire", "hand")}


def scene_with_changes(changes, without=()):
    """The scene after changes: where, as keys with dots between, and what stands there instead."""
    bodies, tables = deepcopy(BODIES), deepcopy(TABLES)
    for where in (*changes, *without):
        name, *keys = where.split(".")
        table = tables if name in tables or not keys else bodies
        for key in keys:
            table, name = table[name], key
        if where in changes:
            table[name] = changes[where]
        else:
            del table[name]
    made = {"dish": "evaporating_dish", "cup": "" if "cavity" in bodies["cup"] else "dropper"}
    return Scene(
        bodies=tuple(
            SceneBody(name, tags=("vessel",) if name in HOLDS else (), instrument=made.get(name, ""), extra=extra)
            for name, extra in bodies.items()
        ),
        effects=tuple(SceneEffect(reported.pop("kind"), reported) for reported in tables.values()),
    )


def scene_of_kinds(kinds):
    """The scene with a table of each of these kinds, and those without which they are refused."""
    firsts = {reported["kind"]: name for name, reported in reversed(TABLES.items())}
    kept = {name for kind in kinds for name in (firsts[kind], *WITH.get(kind, ()))}
    return scene_with_changes({}, TABLES.keys() - kept)


LAMP = {"of": ["hand-left"], "hazard": "lamp", "distance": 0.3}
TWO = (SceneBody("hand-left", tags=("hand", "left")), SceneBody("lamp", extra={"mass": 0.1}))


def small_session(*effects):
    """A hand that passes by a lamp, and what it pressed."""
    positions = [3.0 - 0.1 * k for k in range(22)] + [1.2] * 10
    session = unit_cubes_on_x(
        {"hand-left": positions, "lamp": [0.0] * len(positions)}, scene=Scene("passing", TWO, effects=effects)
    )
    object.__setattr__(session, "hands", {"ann/left": HandTrack(session.frames.stamp_ns)})
    return session


HAND_NEAR_LAMP = SceneEffect("hazard-proximity", LAMP)


def run_small(*effects):
    """The result of a run that is asked for nothing but what the scene calls for."""
    return compute(small_session(*effects))


def modules_after(code):
    """Modules in memory after a program ran in an interpreter of its own."""
    program = f"import sys\nsys.path.insert(0, {str(ROOT / 'tests')!r})\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    return set(done.stdout.split())


def heat_of_pouring(a, b, equation, steps=20, excess=None, solids=None, **keys):
    """Joule above the room, the coldest and the warmest in degC of b while a is poured on it in so many steps.

    ``keys`` : more of the reaction.
    """
    bodies = (glass("a", cavity=WIDE_BEAKER, **a), glass("b", cavity=WIDE_BEAKER, **b))
    liquids = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0, "heat_capacity_j_per_ml_k": WATER_J_PER_ML_K}
    effects = (
        SceneEffect("pour", {"from": ["a"], "into": ["b"]}),
        SceneEffect("mixing", {"in": ["b"]}),
        *([SceneEffect("reaction", {"equation": equation, **keys})] if equation else []),
        SceneEffect("heat", liquids),
    )
    scene = Scene(bodies=bodies, effects=effects)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    contents = contents_of_scene(scene, "scene.toml")
    recipe = recipe_of(tables, contents)
    acid = "H2SO4" if any("H2SO4" in held.amounts for held in contents.values()) else ""
    warmth = Warmth(
        WATER_J_PER_ML_K,
        {},
        excess or {},
        loss=0.0,
        most=80.0,
        room=20.0,
        solids=solids or {},
        solute=acid and acid + ADDED_SUFFIX,
        dilution=dilution_of(acid, has_phreeqc=recipe.solver is not None),
    )
    book = recipe.ledger(0.0, warmth)
    book.begin(0.0)
    index, celsius = book.at["b"], []
    for step in range(1, steps + 1):
        volume = np.array([[contents["a"].volume_ml / steps]])
        book.flow(np.array([step]), np.array([0.1 * step]), [("a", "b")], volume, np.zeros(1, dtype=bool))
        celsius.append(float(book.celsius(index, book.state[index : index + 1])[0]))
    joule = book.amounts[index, book.column[HEAT_COLUMN]] + book.amounts[index, book.column[LATENT_HEAT_COLUMN]]
    return float(joule), min(celsius), max(celsius)
