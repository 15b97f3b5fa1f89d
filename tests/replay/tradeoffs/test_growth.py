import numpy as np
import pytest

from cdcore import detect_live
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.outputs.tradeoff_table import growth_table
from replay.prepare.assemble import assemble
from replay.tradeoffs import growth
from replay.tradeoffs.decimation import with_faces
from replay.tradeoffs.growth import at_rate, copied, grow, grown, growth_answer, leaves_at


@pytest.fixture(scope="module")
def assembly(bumped):
    return assemble(bumped)


def verdicts(assembly, spec="exact"):
    return make_detector(parse_detector(spec), assembly, 0).detect(assembly.motion).verdict


@pytest.mark.parametrize("wanted", [12, 40, 500, 5000])
def test_more_faces_are_the_same_closed_surface(assembly, wanted):
    mesh = with_faces(assembly.bodies[0].mesh, wanted)
    assert wanted / 2 < len(mesh.faces) <= 2 * wanted and mesh.is_closed
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(6.0)
    size, bigger = grown(assembly, "faces", wanted)
    assert size == len(mesh.faces) and (verdicts(bigger) == verdicts(assembly)).all()


def test_fewer_faces_come_from_a_grid():
    import trimesh

    from cdcore import TriangleMesh

    ball = trimesh.creation.icosphere(subdivisions=4)
    mesh = with_faces(TriangleMesh(ball.vertices, ball.faces), 500)
    assert 250 <= len(mesh.faces) <= 1000 < len(ball.faces)


def test_copies_are_shifted_and_every_pair_is_asked(assembly):
    bigger = copied(assembly, 3)
    assert len(bigger.bodies) == 6 and len(bigger.pairs) == 15 and len(set(bigger.names)) == 6
    shift = bigger.motion.translations[:, 4:] - bigger.motion.translations[:, :2]
    assert np.allclose(shift, [0.22, 0.0, 0.0])
    column = bigger.pairs.tolist().index([2, 3])
    assert (verdicts(bigger)[:, column] == verdicts(assembly)[:, 0]).all()


def test_at_another_rate_bodies_take_the_same_way_and_lost_poses_stay_lost(assembly):
    motion = assembly.motion
    twice = at_rate(motion, 200.0)
    assert len(twice) == 22 and np.allclose(twice.translations[::2], motion.translations[:11])
    middle = (motion.translations[:-1] + motion.translations[1:]) / 2
    assert np.allclose(twice.translations[1::2], middle)
    assert detect_live(make_detector(parse_detector("exact"), assembly, 0), twice).verdict.shape == (22, 1)
    lost = type(motion)(motion.times, motion.translations, motion.rotations, np.arange(12)[:, None] != [5, 99])
    assert (~at_rate(lost, 200.0).valid[:, 0]).sum() in (3, 4) and at_rate(lost, 200.0).valid[:, 1].all()


def row(axis, size, ms, detector="exact", budget=10.0):
    return {"axis": axis, "size": size, "p99_ms": ms, "detector": detector, "budget_ms": budget, "passes": 3}


def test_the_size_that_fills_a_frame_lies_on_the_power_law_between_two_sizes():
    rows = [row("bodies", 10, 1.0), row("bodies", 20, 4.0), row("bodies", 40, 16.0)]
    assert leaves_at(rows, "bodies", "exact") == pytest.approx(20 * 2.5**0.5)
    assert leaves_at(rows[:2], "bodies", "exact") is None and leaves_at(rows, "faces", "exact") is None
    assert leaves_at([row("bodies", 10, 11.0)], "bodies", "exact") == 10


def test_the_answer_and_the_table_say_which_axes_leave_the_budget_and_where():
    rows = [row("bodies", 10, 1.0), row("bodies", 40, 16.0), row("faces", 500, 1.0), row("faces", 5000, 1.1)]
    assert growth_answer(rows) == "Accuracy starts to cost with bodies, not with faces"
    assert growth_answer([*rows, row("faces", 500, 99.0, "hybrid-qaco")]) == growth_answer(rows), (
        "that one is not complete"
    )
    assert growth_answer(rows[:2]) == "Accuracy starts to cost with bodies"
    assert growth_answer(rows[2:]) == "No size tried takes a complete detector out of its budget"
    made = growth_table(rows)
    assert made.rows == (("exact", "leaves at 32", "fits up to 5,000"),) and "3 passes" in made.notes[0]


def test_every_axis_is_timed_and_what_is_hopeless_is_not_grown_further(bumped, monkeypatch):
    monkeypatch.setattr(growth, "SIZES", {"bodies": (1, 2), "faces": (12, 48), "rate": (50.0, 100.0)})
    rows = grow(bumped, detectors=("exact", "sphere"))
    assert [(one["axis"], one["size"]) for one in rows[::2]] == [
        ("bodies", 2), ("bodies", 4), ("faces", 12), ("faces", 48), ("rate", 50), ("rate", 100),
    ]  # fmt: skip
    assert all(one["p99_ms"] > 0 for one in rows) and rows[-1]["budget_ms"] == 10.0
    monkeypatch.setattr(growth, "HOPELESS", 0.0)
    assert len(grow(bumped, detectors=("exact",))) == 3
    assert len(grow(bumped, detectors=("exact",), time_limit=0.0)) == 1
