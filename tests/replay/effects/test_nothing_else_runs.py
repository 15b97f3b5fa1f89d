"""Undeclared effects cost nothing: neither plan nor imports, topics, meshes, entities or columns."""

import json
import random
import sys
from itertools import combinations

import pytest
from support import liquid_worlds as proofs
from support.liquid_worlds import HAND_NEAR_LAMP, run_small, scene_of_kinds, small_session

from replay.effects import EFFECTS, load_effect
from replay.effects.effect_plan import plan
from sessions.model.scene import SceneEffect
from sessions.synthetic.scenes import SCENES

KINDS = tuple(EFFECTS)

MOST = 300
"""Subsets drawn where all would be too many."""


def subsets():
    """None, every one, every two, all, and many at random."""
    drawn = random.Random(8)
    some = [tuple(kind for kind in KINDS if drawn.random() < drawn.random()) for _ in range(MOST)]
    return [(), *combinations(KINDS, 1), *combinations(KINDS, 2), KINDS, *some]


@pytest.mark.parametrize("every", [20, pytest.param(1, marks=pytest.mark.slow)], ids=["1 subset in 20", "all subsets"])
def test_a_plan_is_the_closure_of_the_declared_effects(every):
    """A scene declares a subset of all kinds of effects: the plan has these, and those that they need.

    Others are listed as not run. An effect stands after those whose output it reads. Detectors, and pairs of bodies for
    them, are planned only where the spec of a planned effect names a detector, as it does where it needs contacts.
    """
    for kinds in subsets()[::every]:
        scene = scene_of_kinds(kinds)
        planned = plan(scene)
        needed = {other for step in planned.steps.values() for other in step.spec.needed_kinds(step.declared)}
        assert set(planned.effects) == {effect.kind for effect in scene.effects} | needed, kinds
        assert set(planned.not_run) == set(KINDS) - set(planned.effects)
        for kind, step in planned.steps.items():
            assert all(planned.effects.index(item) < planned.effects.index(kind) for item in step.inputs)
        with_detector = {kind for kind in planned.effects if load_effect(kind).detector}
        assert set(planned.detectors) == {load_effect(kind).detector for kind in with_detector}
        assert bool(planned.pairs) == planned.detection == bool(with_detector), kinds
        assert {frozenset(pair) for pair in planned.pairs} == {
            frozenset(pair) for kind in with_detector for pair in planned.steps[kind].pairs
        }


@pytest.mark.slow
def test_the_files_of_undeclared_effects_are_never_imported():
    """Another interpreter plans a scene of each kind of effect; the program fails where its assertion does.

    It forgets the effects' modules before each plan, after which only those of the planned effects are imported.
    """
    code = (
        "from support.liquid_worlds import scene_of_kinds\nfrom replay.effects import EFFECTS\n"
        "from replay.effects.effect_plan import plan\n"
        "modules = {kind: entry.partition(':')[0] for kind, entry in EFFECTS.items()}\n"
        "def imported(): return set(modules.values()) & set(sys.modules)\n"
        "scenes = {kind: scene_of_kinds([kind]) for kind in EFFECTS}\n"
        "for kind in EFFECTS:\n"
        "    for name in imported(): del sys.modules[name]\n"
        "    planned = plan(scenes[kind])\n"
        "    expected = {modules[effect] for effect in (*planned.effects, kind)}\n"
        "    assert imported() == expected, (kind, imported())\n"
    )
    assert "replay.effects.effect_plan" in proofs.modules_after(code)


@pytest.mark.slow
def test_a_run_without_contacts_loads_no_compiler_or_engine():
    """A hand passes a lamp, and the scene declares hazard-proximity only, which needs distances and no contacts.

    numba compiles kernels of the detectors, fcl is another collision engine; both serve contacts alone.
    """
    loaded = proofs.modules_after(
        "from support.liquid_worlds import HAND_NEAR_LAMP, run_small\nrun_small(HAND_NEAR_LAMP)"
    )
    assert "replay.effects.hazard_proximity" in loaded
    assert not loaded & {"numba", "fcl", "replay.effects.contact", "replay.effects.grasp", "cdcore.detectors.exact"}
    assert not {name for name in loaded if "kernels" in name}


SPIES = """
import json
from collections import Counter
from pathlib import Path

import pyarrow.parquet as pq
from rerun.chunk import RrdReader

from sessions import write_session
from sessions.doctor import meshes
from sessions.mcap.reader import McapFile
from sessions.synthetic.scenes import make_scene_session

folder = Path({folder!r})
write_session(make_scene_session({name!r}, faces=600)[0], folder / "s.mcap")
for name in [name for name in sys.modules if name.startswith("sessions.glassware")]:
    del sys.modules[name]
topics, examined = [], []
payloads, findings = McapFile.payloads, meshes.mesh_findings
McapFile.payloads = lambda self, topic: topics.append(topic) or payloads(self, topic)
meshes.mesh_findings = lambda name, mesh: examined.append(name) or findings(name, mesh)
from replay.running.runner import run
from replay.document.coding import plain_of
result = run(folder / "s.mcap", out=folder / "run")
tables = {{path.stem: pq.read_table(path) for path in (folder / "run").glob("*.parquet")}}
drawn = {{str(chunk.entity_path) for chunk in RrdReader(str(folder / "run" / "run.rrd")).stream()}}
(folder / "touched.json").write_text(json.dumps({{
    "topics": topics, "examined_meshes": examined, "drawn": sorted(drawn), "plan": plain_of(result.document.plan),
    "effects_of_document": list(result.document.effects), "effects_run": list(result.effects),
    "sources_of_events": sorted(set(tables["events"]["source"].to_pylist())),
    "effects_of_series": sorted(set(tables["series"]["effect"].to_pylist())) if "series" in tables else [],
    "columns_of_frames": tables["frames"].column_names,
}}))
"""
"""What a run of a whole scene touches: topics, meshes, entities, rows."""


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_a_run_touches_only_what_its_effects_require(name, tmp_path):
    """A made-up session of the scene is run in another interpreter, which reports what the run touched.

    Checked are effects, modules, topics read, meshes examined, entities of the picture, and tables' rows and columns.
    A run that detects contacts (``audits``) may have more of them: hands, detectors, lanes, counters.
    """
    loaded = proofs.modules_after(SPIES.format(folder=str(tmp_path), name=name))
    report = json.loads((tmp_path / "touched.json").read_text())
    planned_bodies, audits = set(report["plan"]["bodies"]), bool(report["plan"]["detection"])
    kinds = set(report["plan"]["effects"])
    not_declared = set(KINDS) - kinds
    assert kinds == set(report["effects_of_document"]) == set(report["effects_run"])
    assert set(report["plan"]["not_run"]) == not_declared

    assert not {EFFECTS[kind].partition(":")[0] for kind in not_declared} & loaded
    assert bool({"numba", "fcl", "replay.effects.contact"} & loaded) == audits
    chemistry = {f"replay.effects.chemistry.{module}" for module in ("ledger", "mixture", "solver")}
    assert bool(chemistry & loaded) == ("mixing" in kinds)
    assert "phreeqc" not in loaded or "mixing" in kinds

    hand_topics = {topic for topic in report["topics"] if topic.startswith("/hands")}
    # An audit reads hands too: it counts contacts of a hand with a body that it grasps apart.
    assert bool(hand_topics) == ("grasp" in kinds or audits)
    assert set(report["topics"]) - hand_topics <= LOGGED_TOPICS
    assert set(report["examined_meshes"]) == planned_bodies

    drawn = [path.split("/")[1:] for path in report["drawn"]]
    drawn_bodies = {path[1] for path in drawn if path[0] == "world" and path[-1] == "mesh"}
    assert audits or drawn_bodies == planned_bodies
    assert {path[1] for path in drawn if path[0] == "effects"} <= kinds | {"curve"}  # a titration's curve
    assert audits or not {path[0] for path in drawn} & {"detectors", "lanes", "counters"}

    assert {row for row in report["sources_of_events"] if row.startswith("effect/")} <= {f"effect/{k}" for k in kinds}
    assert set(report["effects_of_series"]) <= kinds
    assert audits or not any("/" in column for column in report["columns_of_frames"])  # detector/pair


LOGGED_TOPICS = {"/events", "/intervals", "/contacts/live"}
"""Topics that every run shows as they are."""


OUTSIDE = """
from replay.effects.declaring import Field
from replay.effects.output import EffectEvent, EffectOutput
from replay.effects.protocol import EffectSpec

def compute(inputs):
    names = [name for declared in inputs.declared for name in declared["of"]]
    return EffectOutput(events=tuple(EffectEvent(float(inputs.times[0]), "seen", (name,)) for name in names))

SPEC = EffectSpec("glow", "Things glow.", compute, fields={"of": Field("bodies", "what glows")})
"""


def test_an_outside_effect_is_a_file_and_a_row(tmp_path, monkeypatch):
    """An installed distribution, glow 1.0, has an entry point for an effect that reports an event for each body.

    Its file is imported only where a scene declares glow: not where the scene has another effect.
    """
    (tmp_path / "glow_effect.py").write_text(OUTSIDE, encoding="utf-8")
    info = tmp_path / "glow-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: glow\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[vrlab_replay.effects]\nglow = glow_effect:SPEC\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert "glow" in plan(small_session(HAND_NEAR_LAMP).scene).not_run and "glow_effect" not in sys.modules
    result = run_small(SceneEffect("glow", {"of": ["lamp", "hand-left"]}))
    assert [event.bodies for event in result.effects["glow"].events] == [("lamp",), ("hand-left",)]
    assert "glow_effect" in sys.modules
    sys.modules.pop("glow_effect")
