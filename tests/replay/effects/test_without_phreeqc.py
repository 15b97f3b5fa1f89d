"""Imports of PHREEQC, and the sentence of a scene where the extra is not installed."""

import importlib.util

import pytest
from support import liquid_worlds as proofs

from replay.effects.chemistry import database
from replay.effects.effect_plan import plan
from replay.errors import PlanError
from sessions.synthetic.experiments.record import experiment

WITH_EQUILIBRIUM = ("titration", "silver-chloride", "carbonate-titration", "marble", "ammonia-calorimetry")
"""Made-up experiments with a reaction without a rate, a precipitation or an indicator."""

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
@pytest.mark.parametrize("name", WITH_EQUILIBRIUM)
def test_without_the_extra_a_scene_gets_a_sentence(name):
    """``name``: a made-up experiment with an equilibrium; its only fault is that PHREEQC must be installed."""
    with pytest.raises(PlanError) as refused:
        plan(experiment(name).scene())
    (fault,) = refused.value.faults
    assert fault.endswith(
        "the chemistry of this scene needs PHREEQC; install it: pip install 'vrlab-replay[chemistry]'"
    )


@pytest.mark.usefixtures("phreeqc_not_installed")
@pytest.mark.parametrize("name", ["acid-dilution", "gas-collection"])
def test_scene_without_equilibrium_is_planned_without_the_extra(name):
    """``name``: a made-up experiment; one dilutes an acid without a reaction, the other's only reaction has a rate."""
    assert plan(experiment(name).scene()).effects
