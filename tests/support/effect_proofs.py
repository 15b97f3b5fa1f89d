"""One scene with a table of every kind of effect, parts of it, and what shows that undeclared effects cost nothing."""

import subprocess
import sys
import tomllib
from copy import deepcopy
from pathlib import Path

from support.liquid_worlds import COLUMN, glass
from support.small_worlds import cubes

from replay.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.track import HandTrack

ROOT = Path(__file__).resolve().parents[2]
SCENE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
TABLES, HOLDS, WITH = SCENE["tables"], SCENE["holds"], SCENE["with"]
BODIES = {name: glass(name, 5.0, solutes=solutes).extra for name, solutes in HOLDS.items()}
BODIES["burette"]["cavity"] |= COLUMN
BODIES["flask"]["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.5}
BODIES["dish"] = SCENE["dish"]
BODIES |= {name: {} for name in ("tap", "tube", "lamp", "wire", "hand")}


def scene(changes, without=()):
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
        effects=tuple(SceneEffect(told.pop("kind"), told) for told in tables.values()),
    )


def scene_of(kinds):
    """The scene with a table of each of these kinds, and those without which they are refused."""
    firsts = {told["kind"]: name for name, told in reversed(TABLES.items())}
    kept = {name for kind in kinds for name in (firsts[kind], *WITH.get(kind, ()))}
    return scene({}, TABLES.keys() - kept)


LAMP = {"of": ["hand-left"], "hazard": "lamp", "distance": 0.3}
TWO = (SceneBody("hand-left", tags=("hand", "left")), SceneBody("lamp", extra={"mass": 0.1}))


def small_session(*effects):
    """A hand that passes by a lamp, and what it pressed."""
    places = [3.0 - 0.1 * k for k in range(22)] + [1.2] * 10
    session = cubes({"hand-left": places, "lamp": [0.0] * len(places)}, scene=Scene("passing", TWO, effects=effects))
    object.__setattr__(session, "hands", {"ann/left": HandTrack(session.frames.stamp_ns)})
    return session


NEAR = SceneEffect("hazard-proximity", LAMP)


def run_small(*effects):
    """The result of a run that is asked for nothing but what the scene calls for."""
    return compute(small_session(*effects))


def modules_after(code):
    """Modules in memory after a program ran in an interpreter of its own."""
    program = f"import sys\nsys.path.insert(0, {str(ROOT / 'tests')!r})\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    return set(done.stdout.split())
