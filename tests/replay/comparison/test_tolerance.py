"""A disagreement about at most tau is within tolerance; a deeper one, or one about being inside, never is."""

import io

import numpy as np
import pytest
from rich.console import Console
from support.page_cells import Cells
from support.shapes import ball_mesh, box_mesh, random_rotations
from support.small_worlds import cubes

import replay
from cdcore import Body, Motion, Verdict, create_detector
from replay.cli.run_tables import run_tables
from replay.comparison.compare import compare
from replay.comparison.outcome import Outcome
from replay.comparison.tolerance import Tolerance
from replay.errors import AuditError
from replay.outputs.report.tables import contact_table
from replay.pipeline.engine import compute
from replay.prepare.assembly import Assembly

GAPS = [-1e-3, -1e-5, -2.3e-6, -1.9e-6, -1e-9, 0.0, 1e-9, 1.9e-6, 2.3e-6, 1e-5, 1e-3]
"""Of a ball's extreme vertex off the wall of a box; below 0 inside."""


def world(places):
    bodies = (Body("ball", ball_mesh(0.5)), Body("box", box_mesh()))
    count = len(places)
    move = np.zeros((count, 2, 3))
    move[:, 0, 0] = places
    motion = Motion(np.arange(count) / 90, move, np.tile(np.eye(3), (count, 2, 1, 1)))
    nothing = np.zeros(count, dtype=np.int64)
    return Assembly(bodies, motion, np.array([[0, 1]]), np.zeros(1, bool), nothing, np.ones((count, 2), np.uint8))


def judged(assembly, lie, tau=2e-6, **changed):
    """Outcomes of a subject that says the opposite of the exact detector, in the words of ``lie``."""
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    truth = exact.detect(assembly.motion)
    verdict = np.where(truth.verdict == Verdict.CLEAR, np.uint8(lie), np.uint8(Verdict.CLEAR))
    subject = type(truth)(**{**vars(truth), "verdict": verdict, "detector": "liar", **changed})
    tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), tau)
    return compare(subject, truth, within=tolerance.judge(subject, truth)).outcome[:, 0].tolist()


def test_the_border_is_tau_on_both_sides():
    m, i, t = Outcome.MISSED, Outcome.INVENTED, Outcome.WITHIN_TOLERANCE
    assembly = world([1.0 + gap for gap in GAPS])
    assert judged(assembly, Verdict.CONTACT) == [m, m, m, t, t, t, t, t, i, i, i]
    assert judged(assembly, Verdict.CONTACT, tau=1.2e-5) == [m, *[t] * 9, i]
    assert judged(assembly, Verdict.CONTACT, tau=0.0) == [m] * 6 + [i] * 5


PLANTED = [0.5, 0.99, 1.01, 1.5, 2.5]
"""Depths, in tau, of which the first two are at most tau."""


def cubes_at(places, turn=None):
    """Unit cubes, the first at each of these places, both in a turned world."""
    count, turn = len(places), np.eye(3) if turn is None else turn
    move = np.zeros((count, 2, 3))
    move[:, 0] = np.array(places) @ turn.T
    motion = Motion(np.arange(count) / 90, move, np.tile(turn, (count, 2, 1, 1)))
    nothing = np.zeros(count, dtype=np.int64)
    bodies = (Body("a", box_mesh()), Body("b", box_mesh()))
    return Assembly(bodies, motion, np.array([[0, 1]]), np.zeros(1, bool), nothing, np.ones((count, 2), np.uint8))


@pytest.mark.parametrize("tau", [2e-6, 1e-4])
@pytest.mark.parametrize("sideways", [[0, 0], [0.3, 0], [0, 1e-6], [0.3, 0.2], [1e-6, 2e-7]])
def test_cubes_are_excused_to_tau_and_no_deeper_however_flush_they_stand(sideways, tau):
    places = [[side * (1.0 - depth * tau), *sideways] for depth in PLANTED for side in (1, -1)]
    expected = [Outcome.WITHIN_TOLERANCE] * 4 + [Outcome.MISSED] * 6
    assert judged(cubes_at(places), Verdict.CONTACT, tau) == expected
    turn = random_rotations(np.random.default_rng(3), 1)[0]
    assert judged(cubes_at(places, turn), Verdict.CONTACT, tau) == expected


def test_cubes_that_are_exactly_tau_deep_are_excused():
    tau = 2.0**-19  # 1.9 micrometres: the places below are exact
    assert (
        judged(cubes_at([[1.0 - tau, 0, 0], [1.0 - tau, 0.25, 0]]), Verdict.CONTACT, tau)
        == [Outcome.WITHIN_TOLERANCE] * 2
    )


def test_groups_of_frames_change_nothing(monkeypatch):
    assembly = world([1.0 + gap for gap in GAPS * 3])
    whole = judged(assembly, Verdict.CONTACT)
    monkeypatch.setattr("replay.comparison.tolerance.FRAMES_AT_ONCE", 4)
    assert judged(assembly, Verdict.CONTACT) == whole


def test_being_inside_is_never_a_matter_of_tolerance():
    small = world([0.0, 0.25 - 1e-9])  # a ball of 0.25 in the box, in the middle and a nanometre from the wall
    inside = Assembly(
        (Body("ball", ball_mesh(0.25)), small.bodies[1]),
        small.motion,
        small.pairs,
        small.held,
        small.stamp_ns,
        small.origin,
    )
    assert judged(inside, Verdict.CONTACT) == [Outcome.MISSED] * 2
    assert judged(world([1.0 + 1e-9]), Verdict.CONTAINED) == [Outcome.INVENTED]


def test_a_volume_s_candidate_is_unconfirmed_and_not_excused():
    assert judged(world([1.0 + 1e-9]), Verdict.CANDIDATE) == [Outcome.INVENTED]


def test_an_interval_says_nothing_about_an_instant():
    assert judged(world([1.0 - 1e-9]), Verdict.CONTACT, covers="intervals") == [Outcome.MISSED]


@pytest.mark.parametrize("tau", [-1.0, float("inf"), float("nan")])
def test_a_tolerance_that_is_none_is_refused(tau):
    with pytest.raises(AuditError, match="give metres, 0 or more"):
        Tolerance(world([0.0]), lambda motion: None, tau)


def test_a_run_counts_and_excuses_with_its_tau_and_writes_it_down():
    # unit cubes: overlapping by half, by a micrometre, touching, apart
    session = cubes({"a": [0] * 4, "b": [0.5, 1 - 1e-6, 1.0, 1.5]})
    result = compute(session, detectors="blind=support.planted_detectors:Blind", oracle="exact")
    counted = result.summary["audit"]["blind"]["pair_frames"]
    assert (counted["MISSED"], counted["WITHIN_TOLERANCE"]) == (1, 2)
    assert result.summary["tau"] == 2e-6
    strict = compute(session, detectors="blind=support.planted_detectors:Blind", oracle="exact", tau=0.0)
    assert strict.summary["audit"]["blind"]["pair_frames"]["MISSED"] == 3
    assert strict.summary["tau"] == 0.0


RIGHT = [0.4e-6, 0.9e-6, 2.5e-6, 1e-3, 1e-3, 1e-3, 0.9e-6, 0.4e-6, -1e-3, -1e-3]
"""How deep b is in a; below 0 apart."""
LEFT = [-1e-3, -0.9e-6, -0.4e-6, 1e-3, 1e-3, 1e-3, 1e-3, -0.4e-6, -1.5e-6, -1e-3]
"""How deep c is in a."""


def planted(right=RIGHT, left=LEFT):
    return cubes({"a": [0] * len(right), "b": 1 - np.array(right), "c": np.array(left) - 1})


def audited(**changed):
    return replay.audit(planted(), detectors="it=support.planted_detectors:Rounding", **changed)


def both_tables(result):
    stream = io.StringIO()
    Console(file=stream, width=160).print(run_tables(result))
    return stream.getvalue(), Cells(contact_table(result)).tables


def test_what_rounding_by_less_than_tau_changed_is_excused_frame_by_frame():
    found = audited()
    frames = found.summary["it"]["pair_frames"]
    assert (frames["WITHIN_TOLERANCE"], frames["MISSED"], frames["INVENTED"]) == (4 + 4, 0, 0)
    assert (frames["BOTH"], frames["NEITHER"]) == (4 + 4, 2 + 2 + 10)
    assert not found.results[0].misses["it"] and found.summary["it"]["episodes"]["missed"] == 0


@pytest.mark.parametrize(
    ("tau", "excused", "missed", "invented"), [(1.2e-6, 7, 0, 1), (0.42e-6, 4, 2, 2), (0.0, 0, 4, 4)]
)
def test_a_smaller_tau_excuses_only_what_it_holds(tau, excused, missed, invented):
    frames = audited(tau=tau).summary["it"]["pair_frames"]
    assert (frames["WITHIN_TOLERANCE"], frames["MISSED"], frames["INVENTED"]) == (excused, missed, invented)


def test_terminal_and_report_show_what_was_excused_of_each_pair():
    terminal, page = both_tables(audited().results[0])
    assert "within tolerance" in terminal
    rows = {line.split()[0]: line.split()[-1] for line in terminal.splitlines() if line.strip().startswith("a-")}
    assert rows == {"a-b": "4", "a-c": "4"}
    ((_, table),) = page.items()
    assert {row[0]: row[-1] for row in table} == {"a-b": "4", "a-c": "4"}


def test_where_nothing_was_excused_there_is_no_such_column():
    terminal, page = both_tables(audited(tau=0.0).results[0])
    assert "within tolerance" not in terminal
    ((_, table),) = page.items()
    assert {len(row) for row in table} == {8}
