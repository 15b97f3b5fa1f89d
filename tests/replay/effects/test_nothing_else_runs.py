"""Undeclared effects cost nothing: neither plan nor imports, topics, meshes, entities or columns."""

import json
import random
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


@pytest.mark.parametrize("every", [20, pytest.param(1, marks=pytest.mark.slow)])
def test_a_plan_is_the_closure_of_the_declared_effects(every):
    """``every``: one of so many subsets of kinds. Detectors and pairs are planned only for effects that ask them."""
    for kinds in subsets()[::every]:
        scene = scene_of_kinds(kinds)
        planned = plan(scene)
        needed = {other for step in planned.steps.values() for other in step.spec.needed_kinds(step.declared)}
        assert set(planned.effects) == {effect.kind for effect in scene.effects} | needed, kinds
        assert set(planned.not_run) == set(KINDS) - set(planned.effects)
        for kind, step in planned.steps.items():
            assert all(planned.effects.index(item) < planned.effects.index(kind) for item in step.inputs)
        asking = {kind for kind in planned.effects if load_effect(kind).detector}
        assert set(planned.detectors) == {load_effect(kind).detector for kind in asking}
        assert bool(planned.pairs) == planned.detection == bool(asking), kinds
        assert {frozenset(pair) for pair in planned.pairs} == {
            frozenset(pair) for kind in asking for pair in planned.steps[kind].pairs
        }


@pytest.mark.slow
def test_the_files_of_undeclared_effects_are_never_imported():
    """A program of its own plans a scene of each kind: of the effects' files only those of the plan are imported."""
    code = (
        "from support.liquid_worlds import scene_of_kinds\nfrom replay.effects import EFFECTS\n"
        "from replay.effects.effect_plan import plan\n"
        "def there(): return {m for m in sys.modules if m.startswith('replay.effects.')}\n"
        "files = {kind: entry.partition(':')[0] for kind, entry in EFFECTS.items()}\n"
        "scenes = {kind: scene_of_kinds([kind]) for kind in EFFECTS}\n"
        "for kind in EFFECTS:\n"
        "    for name in set(files.values()) & there(): del sys.modules[name]\n"
        "    planned = plan(scenes[kind])\n"
        "    wanted = {files[one] for one in (*planned.effects, kind)}\n"
        "    assert set(files.values()) & there() == wanted, (kind, there())\n"
    )
    assert "replay.effects.effect_plan" in proofs.modules_after(code)


@pytest.mark.slow
def test_a_run_without_contacts_loads_no_compiler_or_engine():
    """A hand passes a lamp: hazard-proximity is all that the scene declares."""
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
tables = {{one.stem: pq.read_table(one) for one in (folder / "run").glob("*.parquet")}}
drawn = {{str(chunk.entity_path) for chunk in RrdReader(str(folder / "run" / "run.rrd")).stream()}}
(folder / "told.json").write_text(json.dumps({{
    "topics": topics, "examined": examined, "drawn": sorted(drawn), "plan": plain_of(result.document.plan),
    "effects": list(result.document.effects), "entered": list(result.effects),
    "counters": [name for one in result.effects.values() for name in one.counters],
    "sources": sorted(set(tables["events"]["source"].to_pylist())),
    "series": sorted(set(tables["series"]["effect"].to_pylist())) if "series" in tables else [],
    "frames": tables["frames"].column_names,
}}))
"""
"""What a run of a whole scene touches: topics, meshes, entities, rows."""


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_a_run_touches_only_what_its_effects_require(name, tmp_path):
    """Modules, topics, meshes, entities of the picture and columns; an audit (``asks``) needs more."""
    loaded = proofs.modules_after(SPIES.format(folder=str(tmp_path), name=name))
    report = json.loads((tmp_path / "told.json").read_text())
    kinds, others = set(report["plan"]["effects"]), set(KINDS) - set(report["plan"]["effects"])
    assert kinds == set(report["effects"]) == set(report["entered"]) and set(report["plan"]["not_run"]) == others
    assert not {EFFECTS[kind].partition(":")[0] for kind in others} & loaded
    asks = bool(report["plan"]["detection"])
    assert bool({"numba", "fcl", "replay.effects.contact"} & loaded) == asks
    chemistry = {f"replay.effects.chemistry.{module}" for module in ("ledger", "mixture", "solver")}
    assert bool(chemistry & loaded) == ("mixing" in kinds)
    assert "phreeqc" not in loaded or "mixing" in kinds
    # An audit reads hands too: it tells contacts of a hand with what it holds apart.
    assert any(topic.startswith("/hands") for topic in report["topics"]) == ("grasp" in kinds or asks)
    assert {topic for topic in report["topics"] if not topic.startswith("/hands")} <= LOGGED
    assert set(report["examined"]) == set(report["plan"]["bodies"])
    bodies = {path.split("/")[2] for path in report["drawn"] if path.startswith("/world/") and path.endswith("/mesh")}
    assert asks or bodies == set(report["plan"]["bodies"])
    assert {path.split("/")[2] for path in report["drawn"] if path.startswith("/effects/")} <= kinds | {"curve"}
    assert asks or not any(path.startswith(("/detectors", "/lanes", "/counters")) for path in report["drawn"])
    assert {item for item in report["sources"] if item.startswith("effect/")} <= {f"effect/{kind}" for kind in kinds}
    assert set(report["series"]) <= kinds and (asks or not any("/" in column for column in report["frames"]))


LOGGED = {"/events", "/intervals", "/contacts/live"}
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
    """Another distribution, glow 1.0, has the entry point; its file is imported only where a scene declares glow."""
    import sys

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
