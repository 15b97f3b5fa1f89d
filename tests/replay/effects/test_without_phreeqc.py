"""Imports of PHREEQC, and the sentence of a scene where the extra is not installed."""

import importlib.util

import pytest
from support import liquid_worlds as proofs

from replay.effects.chemistry import database
from replay.effects.effect_plan import plan_faults
from sessions.model.scene import Scene, SceneEffect

WITHOUT_CHEMISTRY = {
    "a pour": "effects_of_tilt_degrees([0.0, 60.0, 60.0])",
    "a pour that is mixed": "effects_of_tilt_degrees([0.0, 60.0, 60.0], None, ('mixing', {'in': ['b']}))",
    "a burette": "effects_of_tap_degrees([0.0, 90.0, 90.0], MIXING_IN_FLASK)",
    "a reaction with a rate": (
        "effects_of_tilt_degrees([0.0, 60.0, 60.0], (glass('a', 60.0, solute='H2O2', molar=0.1), glass('b', 10.0)), "
        "('mixing', {'in': ['b']}), ('reaction', {'equation': '2 H2O2 -> 2 H2O + O2', 'rate_per_s': 0.1}))"
    ),
}


@pytest.mark.slow
def test_only_scenes_with_an_equilibrium_import_phreeqc():
    """Another interpreter runs scenes that need no chemistry: no PHREEQC is in memory, as it asserts itself.

    Then it runs a titration of HCl with NaOH, which needs PHREEQC.
    """
    runs = "\n".join(WITHOUT_CHEMISTRY.values())
    loaded = proofs.modules_after(
        "from support.liquid_worlds import MIXING_IN_FLASK, NEUTRALISATION\n"
        "from support.liquid_worlds import effects_of_tap_degrees, effects_of_tilt_degrees, glass\n"
        f"{runs}\n"
        "assert {'replay.effects.pour', 'replay.effects.burette'} <= set(sys.modules)\n"
        "assert not {name for name in sys.modules if name.partition('.')[0] in ('phreeqc', '_phreeqc')}\n"
        "effects_of_tap_degrees([0.0, 90.0, 90.0], MIXING_IN_FLASK, NEUTRALISATION)"
    )
    assert "phreeqc" in loaded


@pytest.fixture
def phreeqc_not_installed(monkeypatch):
    """The extra is not there, and no data base that was read before is remembered."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    database.database_of.cache_clear()
    yield
    database.database_of.cache_clear()


@pytest.mark.usefixtures("phreeqc_not_installed")
def test_without_the_extra_a_scene_gets_a_sentence():
    """A scene has a reaction without a rate, a precipitation or the colour of an indicator: each needs an equilibrium.

    The only fault is that PHREEQC, which computes it, is missing, and how to install it.
    """
    advice = "the chemistry of this scene needs PHREEQC; install it: pip install 'vrlab-replay[chemistry]'"
    for kind in ("reaction", "precipitation", "colour"):
        (fault,) = plan_faults(proofs.scene_of_kinds([kind]))
        assert fault.endswith(advice), kind


@pytest.mark.usefixtures("phreeqc_not_installed")
def test_scene_without_equilibrium_is_planned_without_the_extra():
    """A scene that only mixes liquids, and one whose only reaction, the decay of peroxide, has a rate: no fault."""
    decay = SceneEffect("reaction", {"equation": "2 H2O2 -> 2 H2O + O2", "rate_per_s": 0.1})
    mixing = SceneEffect("mixing", {"in": ["flask"]})
    flask = proofs.glass("flask", 50.0, solute="H2O2", molar=0.1)
    assert plan_faults(proofs.scene_of_kinds(["mixing"])) == ()
    assert plan_faults(Scene(bodies=(flask,), effects=(mixing, decay))) == ()
