import numpy as np
import pytest
from support.small_worlds import cubes

from replay.effects.effect_plan import Plan, Step
from replay.effects.effects_runner import run_effects
from replay.effects.output import EffectOutput
from replay.effects.protocol import EffectSpec
from replay.errors import EffectError
from replay.prepare.assemble import assemble


def planned(*specs, **inputs):
    steps = {s.kind: Step(s, (), (), inputs.get(s.kind, ()), ("the scene declares it",)) for s in specs}
    return Plan(steps, (), detection=False, bodies={"a": ("x",)})


def ran(*specs, **inputs):
    session = cubes({"a": [0, 0, 0, 0], "b": [3, 3, 2, 3]})
    return run_effects(planned(*specs, **inputs), session, assemble(session), {})


def spec(kind, compute, **more):
    return EffectSpec(kind, "x", compute, **more)


def test_an_effect_gets_the_outputs_of_its_inputs_and_no_others():
    seen = {}

    def second(inputs):
        seen.update(inputs.outputs)
        return EffectOutput()

    one, two = (spec(kind, lambda i, k=k: EffectOutput(data=k)) for k, kind in ((1, "one"), (2, "two")))
    ran(one, two, spec("x", second), x=("two",))
    assert {kind: output.data for kind, output in seen.items()} == {"two": 2}


def test_frames_in_which_the_trigger_was_off_are_counted_and_shown():
    mask = np.array([False, True, True, False])
    run = ran(spec("pour", lambda inputs: EffectOutput(ran=mask)))["pour"]
    assert (run.frames, run.frames_run) == (4, 2)
    spans = [(s.start, s.end, s.word) for s in run.output.lanes["skipped"]]
    assert spans == [(0.0, 0.01, "skipped"), (0.03, 0.03, "skipped")]


@pytest.mark.parametrize(("error", "said"), [
    (KeyError("radius"), r"^effect 'boil' \(.*test_effects_runner\) failed: KeyError: 'radius'; report it to its"),
    (EffectError("no water"), "^no water$"),
])  # fmt: skip
def test_an_effect_that_fails_names_itself_and_its_package(error, said):
    def compute(inputs):
        raise error

    with pytest.raises(EffectError, match=said):
        ran(spec("boil", compute))


def test_detections_are_kept_from_effects_that_name_no_detector():
    with pytest.raises(EffectError, match="name a `detector`"):
        ran(spec("pour", lambda inputs: inputs.contact(("a", "b"))))
