"""An effect gets what its spec names and nothing else; its skipped frames, its digest and its failure are told."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import along_x, cube, unit_cubes_on_x

from replay.effects.effect_plan import Plan, Step
from replay.effects.effects_runner import recorded_scalars, run_effects
from replay.effects.inputs import HANDS_TOPIC, BodyPoses
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Liquid, Series
from replay.effects.protocol import EffectSpec
from replay.engine import compute
from replay.errors import EffectError
from replay.prepare.assemble import assemble
from sessions import ScalarTrack, Session
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import HandTrack


def runs_of_specs(*specs, **inputs):
    """Runs of these effects over 4 frames: a cup that moves by 1 m in each, a hand, and a body that is lost.

    ``inputs``: kind of an effect -> kinds whose outputs it gets.
    """
    steps = {
        effect_spec.kind: Step(effect_spec, (), (), inputs.get(effect_spec.kind, ()), ("declared",))
        for effect_spec in specs
    }
    known = dict.fromkeys(("cup", "hand_left", "lost"), ("it is named",))
    poses = {"cup": along_x([0, 1, 2, 3]), "hand_left": along_x([5, 5, 6, 6])}
    scene = Scene(bodies=tuple(map(SceneBody, known)))
    session = Session.from_arrays(np.arange(4) * 10**7, poses, {name: cube() for name in poses}, scene)
    hands = {f"{who}/{side}": HandTrack([0, 10**7]) for who in ("ann", "bob") for side in ("left", "right")}
    session = replace(session, hands=hands)
    return run_effects(Plan(steps, (), detection=False, bodies=known), session, assemble(session), {})


def effect_spec(kind, compute, **more):
    """An effect of this kind that is computed so; ``more``: what else it reads or needs."""
    return EffectSpec(kind, "x", compute, **more)


def answer_and_run(ask, **more):
    """The answer of ``ask`` to the inputs of an effect ``pour``, and the effect's run; ``more``: of its spec."""
    actual = []
    run = runs_of_specs(effect_spec("pour", lambda inputs: actual.append(ask(inputs)) or EffectOutput(), **more))[
        "pour"
    ]
    return actual[0], run


@pytest.mark.parametrize(
    ("ask", "text"),
    [
        (lambda inputs: inputs.poses("flask"), "which no declared effect names"),
        (lambda inputs: inputs.mesh("flask"), "which no declared effect names"),
        (lambda inputs: inputs.poses("lost"), "has no mesh or was not recorded"),
        (lambda inputs: inputs.output("contact"), "name it in `needs`"),
        (lambda inputs: inputs.hand_of("hand_left"), "name '/hands' in `reads`"),
        (lambda inputs: inputs.contact(("cup", "lost")), "name a `detector`"),
    ],
    ids=["poses", "mesh", "lost body", "output", "hand", "contact"],
)
def test_an_effect_gets_only_inputs_of_its_spec(ask, text):
    """``ask``: what the effect's code wants and its spec does not name; ``text``: of the error, with the remedy."""
    with pytest.raises(EffectError, match=text):
        answer_and_run(ask)


def test_an_error_of_an_effect_names_its_module():
    """The effect pour, written in this file, looks up a key that does not exist."""
    text = r"^effect 'pour' \(.*test_effects_runner\) failed: KeyError: 'radius'; report"
    with pytest.raises(EffectError, match=text):
        answer_and_run(lambda inputs: {}["radius"])


def test_a_hand_is_chosen_by_tags_and_name():
    """Hands of Ann and Bob are recorded: body hand_left is the left hand of Ann, who is first, and a cup is no hand.

    No hand but this is decoded.
    """
    is_left_hand_of_ann, run = answer_and_run(
        lambda inputs: inputs.hand_of("hand_left") is inputs.session.hands["ann/left"], reads=(HANDS_TOPIC,)
    )
    assert is_left_hand_of_ann and run.counters == {"decoded /hands/ann/left": 1}
    hand_of_cup, _run = answer_and_run(lambda inputs: inputs.hand_of("cup"), reads=(HANDS_TOPIC,))
    assert hand_of_cup is None


def test_an_effect_gets_only_outputs_of_its_inputs():
    """The effect ``last`` has ``second`` as its input, and so gets nothing of ``first``."""
    received = {}
    first = effect_spec("first", lambda inputs: EffectOutput(data="output of first"))
    second = effect_spec("second", lambda inputs: EffectOutput(data="output of second"))
    last = effect_spec("last", lambda inputs: received.update(inputs.outputs) or EffectOutput())
    runs_of_specs(first, second, last, last=("second",))
    assert {kind: output.data for kind, output in received.items()} == {"second": "output of second"}


def test_skipped_frames_are_counted_and_are_a_lane():
    """An effect skips the first and the last of four frames at 0, 10, 20 and 30 ms, which the lane "skipped" shows.

    A span ends at the stamp of the next frame; after the last frame there is none, so its span has no length.
    """
    ran = np.array([False, True, True, False])
    run = runs_of_specs(effect_spec("pour", lambda inputs: EffectOutput(ran=ran)))["pour"]
    assert (run.frames, run.frames_run) == (4, 2)
    assert [(span.start, span.end) for span in run.output.lanes["skipped"]] == [(0.0, 0.01), (0.03, 0.03)]


TIMES = np.arange(3.0)
LIQUID = Liquid(TIMES, np.ones(3), floor=0.1, radius=0.2, rgba=np.zeros((3, 4), dtype=np.uint8))
SPILL = EffectEvent(
    time=1.0, name="spill", bodies=("cup",), end=2.0, values={"volume_ml": np.float64(3.0)}, point=(0.0, 1.0, 2.0)
)
OUTPUT = EffectOutput(
    (SPILL,),
    {"cup/volume": Series(TIMES, TIMES * 2, "mL")},
    {"cup": (LaneSpan(start=0.0, end=1.0, word="pours"),)},
    np.array([True, False, True]),
    {"cup": LIQUID},
)


def test_any_visible_difference_changes_the_digest():
    """``changed``: a field of an effect's output -> another value of it; the digest is a SHA-256 of the output."""
    for case, changed in {
        "last digit of a value": {"events": (replace(SPILL, values={"volume_ml": 3.0000001}),)},
        "last bit of a series": {"series": {"cup/volume": Series(TIMES, np.nextafter(TIMES * 2, 9), "mL")}},
        "unit": {"series": {"cup/volume": Series(TIMES, TIMES * 2, "L")}},
        "no lanes": {"lanes": {}},
        "frames run": {"ran": None},
        "height of a liquid": {"liquids": {"cup": replace(LIQUID, floor=0.11)}},
    }.items():
        assert replace(OUTPUT, **changed).digest != OUTPUT.digest, case


def test_data_that_no_screen_shows_does_not_change_the_digest():
    """The field ``data`` passes objects from an effect to the next."""
    assert replace(OUTPUT, data=object()).digest == OUTPUT.digest


@pytest.fixture(scope="module")
def session_with_pulse():
    """Two cubes in 100 frames of 10 ms, and two recorded numbers: "pulse" and "late".

    The pulse, 70 to 79, is 3 ns after every tenth frame; "late" begins 10 s after the session.
    """
    cubes = unit_cubes_on_x({"a": [0.0] * 100, "b": [3.0] * 100}, first_ns=10**9)
    stamps = cubes.stamps()
    pulse = ScalarTrack(stamps[::10] + 3, 70 + np.arange(10.0), "1/min")
    return replace(cubes, scalars={"pulse": pulse, "late": ScalarTrack(stamps + 10**10, np.zeros(100))})


def test_scalars_recorded_outside_the_session_are_left_out(session_with_pulse):
    """A pulse is recorded 3 ns after every tenth of 100 frames of 10 ms; another number, 10 s after the session."""
    run = compute(session_with_pulse, detectors=()).effects["scalars"]
    (series,) = run.series.values()
    assert series.unit == "1/min" and series.values.tolist() == [70.0 + k for k in range(10)]
    assert np.allclose(series.times, 0.1 * np.arange(10) + 3e-9) and run.because == ("it was recorded",)
    longest_s = 9.0  # it takes milliseconds; a single reading of a clock, not a difference, would be far more
    assert 0.0 <= run.seconds < longest_s


def test_a_run_over_an_interval_has_its_scalars_only(session_with_pulse):
    """A pulse, 70 + k, is recorded at k tenths of a second: from 0.2 to 0.49 s these are the pulses 2 to 4."""
    run = compute(session_with_pulse, detectors=(), start=0.2, end=0.49).effects["scalars"]
    assert run.series["pulse"].values.tolist() == [72.0, 73.0, 74.0]


def test_no_recorded_scalars_give_no_effect(session_with_pulse):
    """A session has no recorded numbers, such as of a trigger, and its scene declares no effect: none is computed."""
    assert compute(replace(session_with_pulse, scalars={}), detectors=()).effects == {}


def test_a_point_of_a_body_follows_its_pose():
    """The cup's origin is at x = 3 m in frame 3, unrotated; the point is 0.1, 0.2 and 0.3 m from it."""
    point, _ = answer_and_run(lambda inputs: inputs.poses("cup").point([0.1, 0.2, 0.3]))
    frame = 3
    assert point[frame] == pytest.approx([3.1, 0.2, 0.3])


def test_recorded_numbers_count_within_the_frames():
    """Frames are at 0, 10, 20 and 30 ms; the pulse is recorded at -1, 0, 15, 30 and 31 ms, which counts from 0 to 30.

    A sensor that is recorded at 31 ms only has no series, and where there is no other no effect runs.
    """
    ms, first_ns = 10**6, 10**9
    poses = {"cup": along_x([0, 1, 2, 3]), "hand_left": along_x([5, 5, 6, 6])}
    session = Session.from_arrays(first_ns + np.arange(4) * 10 * ms, poses, {name: cube() for name in poses})
    pulse = ScalarTrack(first_ns + np.array([-1, 0, 15, 30, 31]) * ms, [1.0, 2.0, 3.0, 4.0, 5.0], "bpm")
    after = ScalarTrack(first_ns + np.array([31]) * ms, [9.0], "bpm")
    session = replace(session, scalars={"pulse": pulse, "after": after})
    series = recorded_scalars(session, assemble(session))["scalars"].output.series
    assert set(series) == {"pulse"} and series["pulse"].values.tolist() == [2.0, 3.0, 4.0]
    assert series["pulse"].times.tolist() == pytest.approx([0.0, 0.015, 0.03]) and series["pulse"].unit == "bpm"
    assert recorded_scalars(replace(session, scalars={"after": after}), assemble(session)) == {}


def test_last_known_pose_stays_while_a_body_is_lost():
    """The body's pose is known in the frames 1 and 3 of four: in 2 it is that of 1, and in 0 there is none yet."""
    positions = np.arange(12.0).reshape(4, 3)
    valid = np.array([False, True, False, True])
    poses = BodyPoses(np.arange(4.0), positions, np.tile(np.eye(3), (4, 1, 1)), valid, np.ones(4, dtype=bool))
    known = poses.last_known()
    assert known.valid.tolist() == [False, True, True, True]
    assert np.array_equal(known.translation[1:], positions[[1, 1, 3]])
