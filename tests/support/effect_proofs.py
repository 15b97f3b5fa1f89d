"""One scene with a table of every kind of effect, parts of it, and what shows that undeclared effects cost nothing."""

import subprocess
import sys
from copy import deepcopy
from pathlib import Path

from support.liquid_worlds import COLUMN, TAP, glass
from support.small_worlds import cubes

from replay.pipeline.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.track import HandTrack

ROOT = Path(__file__).resolve().parents[2]
CELSIUS = {"ambient_c": 20.0, "loss_w_per_k": 0.4}
TABLES = {
    "touch": {"kind": "contact", "between": ["hand", "a"]},
    "take": {"kind": "grasp", "between": ["hand", "a"]},
    "fall": {"kind": "breakage", "between": ["a", "dish"], "speed_m_s": 1.0},
    "near": {"kind": "hazard-proximity", "of": ["hand"], "hazard": "lamp", "distance": 0.1},
    "pour": {"kind": "pour", "from": ["a"], "into": ["flask"]},
    "drip": {"kind": "burette", **TAP},
    "mixing": {"kind": "mixing", "in": ["flask"]},
    "neutral": {"kind": "reaction", "equation": "HCl + NaOH -> NaCl + H2O"},
    "silver": {"kind": "reaction", "equation": "AgNO3 + NaCl -> AgCl + NaNO3"},
    "zinc": {"kind": "reaction", "equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 2.0},
    "falls": {"kind": "precipitation", "solid": "AgCl", "ksp": 1.77e-10, "colour": "white"},
    "gas": {"kind": "gas", "gas": "H2", "from": "flask", "tube": "tube", "outlet": [0.0, 0.5, 0.0], "jar": "jar",
            "temperature_c": 20.0, "pressure_pa": 101325.0},
    "pink": {"kind": "colour", "in": "flask", "indicator": "phenolphthalein", "from_ph": 8.2, "to_ph": 10.0,
             "acid_colour": "colourless", "base_colour": "pink"},
    "warm": {"kind": "heat", "of": "neutralisation", **CELSIUS, "heat_capacity_j_per_ml_k": 4.2},
    "flame": {"kind": "heat", "of": "flame", "heats": "dish", "source": "lamp", "base": [0.0, 0.1, 0.0], "within": 0.02,
              "power_w": 160.0, **CELSIUS},
    "test": {"kind": "flame-test", "flame": "lamp", "base": [0.0, 0.1, 0.0], "flame_radius": 0.01,
             "flame_height": 0.05, "wire": "wire", "tip": [0.0, -0.1, 0.0], "seconds": 1.0,
             "colours": {"NaCl": "yellow"}, "vessels": ["flask"], "dips": {"flask": "NaCl"}},
    "burn": {"kind": "burn-exposure", "between": ["hand", "dish"], "threshold_c": 65.0, "seconds": 0.5},
}  # fmt: skip
HOLDS = {
    "a": {"AgNO3": 0.1}, "cup": {}, "jar": {}, "burette": {"NaOH": 0.1},
    "flask": {"HCl": 0.1, "NaCl": 0.1, "CH3COOH": 0.1, "NH3": 0.1, "KNO3": 0.1},
}  # fmt: skip
BODIES = {name: glass(name, 5.0, solutes=solutes).extra for name, solutes in HOLDS.items()}
BODIES["burette"]["cavity"] |= COLUMN
BODIES["flask"]["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.5}
SALT = {"formula": "CuSO4.5H2O", "mass_g": 5.0}
BODIES["dish"] = {"properties": {"heat_capacity_j_per_k": 60.0, "solid": SALT}}
BODIES |= {name: {} for name in ("tap", "tube", "lamp", "wire", "hand")}


def scene(*changes):
    """The scene after changes: where, as keys with dots between, and what stands there; ``None``: nothing does."""
    bodies, tables = deepcopy(BODIES), deepcopy(TABLES)
    for where, value in zip(changes[::2], changes[1::2], strict=True):
        name, *keys = where.split(".")
        table = tables if name in tables or not keys else bodies
        for key in keys:
            table, name = table[name], key
        table[name] = value
        if value is None:
            del table[name]
    made = {"dish": "evaporating_dish", "cup": "" if "cavity" in bodies["cup"] else "dropper"}
    return Scene(
        bodies=tuple(
            SceneBody(name, tags=("vessel",) if name in HOLDS else (), instrument=made.get(name, ""), extra=extra)
            for name, extra in bodies.items()
        ),
        effects=tuple(SceneEffect(told.pop("kind"), told) for told in tables.values()),
    )


WITH = {
    "precipitation": ["silver"], "gas": ["zinc", "mixing"], "colour": ["neutral", "mixing"],
    "burn-exposure": ["flame"], "heat": ["neutral"],
}  # fmt: skip
"""Kind -> tables without which it is refused."""


def scene_of(kinds):
    """The scene with a table of each of these kinds, and those without which they are refused."""
    firsts = {told["kind"]: name for name, told in reversed(TABLES.items())}
    kept = {name for kind in kinds for name in (firsts[kind], *WITH.get(kind, ()))}
    return scene(*(one for name in TABLES if name not in kept for one in (name, None)))


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
