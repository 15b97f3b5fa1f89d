"""Imports of PHREEQC, and the sentence of a scene where the extra is not installed."""

import pytest
from support import liquid_worlds as proofs

from replay.effects.chemistry import database
from replay.effects.effect_plan import plan
from replay.errors import PlanError
from replay.studies.synthetic_sessions import synthetic_session

ASK = {"titration", "silver-chloride", "carbonate-titration", "marble", "ammonia-calorimetry"}
"""Made-up experiments with a reaction without a rate, a precipitation or an indicator."""

QUICK = {"titration", "silver-chloride"}
SENTENCE = "the chemistry of this scene needs PHREEQC; install it: pip install 'vrlab-replay[chemistry]'"

WITHOUT_CHEMISTRY = {
    "a pour": "poured([0.0, 60.0, 60.0])",
    "a pour that is mixed": "poured([0.0, 60.0, 60.0], None, ('mixing', {'in': ['b']}))",
    "a burette": "run_in([0.0, 90.0, 90.0], MIX)",
    "a reaction with a rate": (
        "poured([0.0, 60.0, 60.0], (glass('a', 60.0, solute='H2O2', molar=0.1), glass('b', 10.0)), "
        "('mixing', {'in': ['b']}), ('reaction', {'equation': '2 H2O2 -> 2 H2O + O2', 'rate_per_s': 0.1}))"
    ),
}


def test_scenes_without_equilibrium_import_no_phreeqc():
    runs = "\n".join(WITHOUT_CHEMISTRY.values())
    loaded = proofs.modules_after(f"from support.liquid_worlds import MIX, glass, poured, run_in\n{runs}")
    assert {"replay.effects.pour", "replay.effects.burette"} <= set(loaded)
    assert not {name for name in loaded if name.partition(".")[0] in ("phreeqc", "_phreeqc")}


def test_a_scene_with_an_equilibrium_imports_phreeqc():
    code = "from support.liquid_worlds import MIX, NEUTRAL, run_in\nrun_in([0.0, 90.0, 90.0], MIX, NEUTRAL)"
    assert "phreeqc" in proofs.modules_after(code)


@pytest.mark.parametrize(
    "name",
    [
        "titration",
        "silver-chloride",
        "acid-dilution",
        *(pytest.param(name, marks=pytest.mark.slow) for name in sorted({*ASK, "gas-collection"} - QUICK)),
    ],
)
def test_without_the_extra_a_scene_gets_a_sentence(name, monkeypatch):
    scene = synthetic_session(name)[0].scene
    monkeypatch.setattr(database.importlib.util, "find_spec", lambda _: None)
    database.database_of.cache_clear()
    try:
        if name not in ASK:
            assert plan(scene).effects
            return
        with pytest.raises(PlanError) as refused:
            plan(scene)
        assert len(refused.value.faults) == 1 and refused.value.faults[0].endswith(SENTENCE)
    finally:
        database.database_of.cache_clear()
