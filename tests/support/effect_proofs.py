"""What it takes to prove that undeclared effects cost nothing: declarations of every kind, counts of calls, mutants."""

import subprocess
import sys
from pathlib import Path

from support.small_worlds import cubes

from replay.pipeline.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.track import HandTrack
from sessions.synthetic.experiments.record import experiment

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("acid-dilution", "copper-sulfate", "flame-test", "gas-collection", "silver-chloride", "titration")
EXPERIMENTS = tuple(experiment(name) for name in NAMES)

PEOPLE = {"hand-left": ("hand", "left"), "hand-right": ("hand", "right"), "headset": ("headset",), "bench": ("bench",)}


def declarations():
    """A declaration of every kind there is in the scenes of the experiments, the first one met."""
    found = {}
    for scene in EXPERIMENTS:
        for effect in scene.effects:
            found.setdefault(effect.kind, effect)
    return found


def bodies():
    """All bodies of all experiments, each once, with all tags that any of them has there."""
    tags = {name: set(words) for name, words in PEOPLE.items()}
    for scene in EXPERIMENTS:
        for name, placed in scene.bodies.items():
            made = {"glass", "vessel", "open"} if "bench" not in placed.instrument else set()
            tags.setdefault(name, set()).update(made, placed.tags)
    made = {name: placed.instrument for scene in EXPERIMENTS for name, placed in scene.bodies.items()}
    warm = {"dish": {"properties": {"heat_capacity_j_per_k": 60.0}}}
    there = [
        SceneBody(name, instrument=made.get(name, ""), tags=tuple(sorted(words)), extra=warm.get(name, {}))
        for name, words in tags.items()
    ]
    return (*there, SceneBody("shelf", instrument="beaker_250", extra={"properties": SHELF}))


SHELF = {
    "liquid": {
        "volume_ml": 1.0, "water_molar": 4.0,
        "solutes": {"H2SO4": 1.0, "HCl": 1.0, "NaOH": 1.0, "AgNO3": 1.0, "NaCl": 1.0},
    },
    "solid": {"formula": "Zn", "mass_g": 1.0},
}  # fmt: skip
"""All that any of the equations needs, so that a table may stand alone."""

MAKING = {
    "precipitation": "AgNO3 + NaCl -> AgCl + NaNO3", "gas": "Zn + 2 HCl -> ZnCl2 + H2",
    "colour": "HCl + NaOH -> NaCl + H2O",
}  # fmt: skip
"""Kind -> the reaction without which it is refused."""

FLASK = SceneEffect("mixing", {"in": ["flask"]})
FLAME = SceneEffect("heat", {
    "of": "flame", "source": "lamp", "heats": "dish", "base": [0.0, 0.1, 0.0], "within": 0.02, "power_w": 160.0,
    "loss_w_per_k": 0.4, "ambient_c": 20.0,
})  # fmt: skip
WITH = {"colour": FLASK, "gas": FLASK, "burn-exposure": FLAME}
"""Kind -> the table without which it is refused."""


def scene_of(kinds):
    """A scene that declares these kinds, one table each, and what they are refused without."""
    there = declarations()
    makes = (SceneEffect("reaction", {"equation": MAKING[kind]}) for kind in kinds if kind in MAKING)
    more = (WITH[kind] for kind in kinds if kind in WITH)
    return Scene(bodies=bodies(), effects=(*(there[kind] for kind in kinds), *makes, *more))


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
