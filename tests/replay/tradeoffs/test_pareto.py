from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdcore import TriangleMesh
from cdcore.detectors import DETECTORS, load_detector
from replay.errors import TradeoffError
from replay.tradeoffs.decimation import clustered, coarser
from replay.tradeoffs.pareto import advice_of, counts, front_of
from replay.tradeoffs.settings import ASKED, settings_list


def row(label, ms, missed, *, online=False, oracle=False, precision=1.0, p99=None):
    return {
        "label": label, "ms_per_frame": ms, "missed": missed, "missed_low": missed / 2, "missed_high": missed * 2,
        "online": online, "oracle": oracle, "precision": precision, "p99_ms": p99,
        "precision_low": precision and precision - 0.05, "precision_high": precision and min(1.0, precision + 0.05),
    }  # fmt: skip


rows = st.lists(
    st.builds(
        row, st.just(""), st.integers(1, 8), st.integers(0, 6).map(lambda k: k / 10), online=st.booleans(),
        oracle=st.booleans(), precision=st.sampled_from([0.2, 0.8, 1.0, None]), p99=st.integers(1, 5),
    ),
    max_size=12,
).map(lambda found: [{**one, "label": str(k)} for k, one in enumerate(found)])  # fmt: skip


@given(rows)
def test_a_row_is_on_the_front_exactly_when_nothing_that_counts_beats_it(found):
    may = [one for one in found if not one["oracle"] and (one["precision"] or 0.0) > 0.5]
    front = front_of(found)
    for one in found:
        beaten = any(
            (a["ms_per_frame"], a["missed"]) != (one["ms_per_frame"], one["missed"])
            and a["ms_per_frame"] <= one["ms_per_frame"]
            and a["missed"] <= one["missed"]
            for a in may
        )
        alike = [a["label"] for a in may if (a["ms_per_frame"], a["missed"]) == (one["ms_per_frame"], one["missed"])]
        assert (one["label"] in front) == (one in may and not beaten and alike[0] == one["label"])


def test_advice_names_the_best_at_each_price_once():
    told = advice_of([row("coarse", 0.002, 0.2), row("fine", 0.02, 0.003), row("worse", 0.5, 0.1)])
    assert told == [
        "To audit a recording, at 0.003 ms per frame: coarse, misses 20.0 % [10.0, 40.0].",
        "To audit a recording, at 0.03 ms per frame: fine, misses 0.3 % [0.1, 0.6].",
    ]


def test_one_setting_that_is_quickest_misses_least_and_invents_least_dominates():
    told = advice_of([row("best", 0.01, 0.0), row("other", 0.02, 0.0), row("last", 0.03, 0.5, precision=0.9)])
    assert told == [
        "To audit a recording, best dominates 2 others: nothing is quicker, misses less or invents less: "
        "it misses 0.0 % [0.0, 0.0]."
    ]


def test_one_alone_dominates_nobody():
    for others in ([], [row("sphere", 0.001, 0.0, precision=0.1)]):
        (told,) = advice_of([row("best", 0.01, 0.1), *others])
        assert "dominates" not in told and "only best was tried" in told and "misses 10.0 %" in told


def test_one_that_catches_all_and_invents_does_not_dominate_and_is_named_with_what_it_invents():
    told = advice_of([row("hull", 0.01, 0.0, precision=0.6), row("mesh", 0.02, 0.0), row("late", 0.03, 0.1)])
    assert told == [
        "To audit a recording, nothing is quicker or misses less than hull, misses 0.0 % [0.0, 0.0], "
        "invents 40.0 % [35.0, 45.0]; to invent nothing, mesh, misses 0.0 % [0.0, 0.0]."
    ]


def test_beside_what_invents_stands_what_invents_less_for_the_same_price_and_no_dearer():
    held = row("held", 0.002, 0.3, precision=0.7)
    told = advice_of([held, row("some", 0.0025, 0.6, precision=0.8), row("none", 0.02, 0.1)])
    assert told == [
        "To audit a recording, at 0.003 ms per frame: held, misses 30.0 % [15.0, 60.0], invents 30.0 % [25.0, 35.0]; "
        "to invent less, some, misses 60.0 % [30.0, 120.0], invents 20.0 % [15.0, 25.0].",
        "To audit a recording, at 0.03 ms per frame: none, misses 10.0 % [5.0, 20.0].",
    ]


@given(rows)
def test_whatever_is_said_to_dominate_is_beaten_in_nothing_by_anyone_that_counts(found):
    for sentence in advice_of(found):
        name, dominates, _ = sentence.partition(" dominates")
        if dominates:
            price = "ms_per_frame" if "audit" in sentence else "p99_ms"
            asked = [one for one in found if counts(one) and (one["online"] or price == "ms_per_frame")]
            best = next(one for one in asked if one["label"] == name.rpartition(" ")[2])
            for one in asked:
                assert best[price] <= one[price] and best["missed"] <= one["missed"]
                assert best["precision"] >= one["precision"]


def test_a_live_loop_is_advised_by_its_p99_and_only_on_what_runs_frame_by_frame():
    told = advice_of(
        [
            row("offline", 0.001, 0.0),
            row("slow", 0.3, 0.0, online=True, p99=9.0),
            row("quick", 0.1, 0.4, online=True, p99=2.0),
        ]
    )
    assert told[1:] == [
        "To ship in a live loop, with p99 under 3 ms per frame: quick, misses 40.0 % [20.0, 80.0].",
        "To ship in a live loop, with p99 under 11.1 ms per frame: slow, misses 0.0 % [0.0, 0.0].",
    ]


def test_neither_the_oracle_nor_who_always_says_contact_is_advised():
    assert advice_of([row("exact", 0.1, 0.0, oracle=True), row("sphere", 0.01, 0.0, precision=0.01)]) == []


def test_the_list_holds_every_detector_and_every_axis_once():
    tried = settings_list()
    assert {one.detector for one in tried} == set(DETECTORS)
    axes = {
        "step rate", "shape", "mesh resolution", "tolerance", "samples", "budget", "booleans or faces",
    }  # fmt: skip
    assert axes <= {one.axis for one in tried}
    labels = [one.label for one in tried]
    assert len(labels) == len(set(labels)) >= 40


def test_every_setting_is_one_its_detector_has():
    for one in settings_list():
        detector = load_detector(one.detector)
        assert set(one.settings) <= {item.name for item in fields(detector.Settings)}, one.label
        detector.Settings(**one.settings)


def test_each_point_of_a_line_turns_one_axis_of_one_detector():
    for one in settings_list():
        assert one.line.startswith(one.detector) and (one.axis in one.line) == (one.axis != "as it comes")
        assert one.spec.name == one.detector and dict(one.spec.settings) == dict(one.settings)


def test_whoever_is_asked_for_faces_is_asked_for_booleans_with_the_same_settings():
    asked = [one for one in settings_list() if one.axis == ASKED]
    booleans, faces = ([one for one in asked if one.faces is wanted] for wanted in (False, True))
    assert [one.spec for one in booleans] == [one.spec for one in faces] and len(faces) >= 3
    assert {one.line for one in booleans} == {one.line for one in faces}
    assert f"{faces[0].detector} faces" == faces[0].label


def test_samples_are_faces_of_a_body_and_a_budget_is_evaluations():
    for axis in ("samples", "budget"):
        turned = [one.settings for one in settings_list() if one.axis == axis]
        assert turned and all(set(settings) == {axis} for settings in turned)


def test_what_a_short_time_limit_leaves_advises_on_engines_colliders_and_a_live_loop():
    head = settings_list()[:33]
    assert {"hybrid", "exact", "discrete", "collider", "solid-style"} <= {one.detector for one in head}
    assert {"step rate", "shape", "mesh resolution", "budget"} <= {one.axis for one in head}
    assert len([one for one in head if one.detector == "discrete"]) >= 3


def ball(rings=12):
    """A closed ball of radius 1 m."""
    import trimesh

    made = trimesh.creation.uv_sphere(radius=1.0, count=[rings, 2 * rings])
    return TriangleMesh(made.vertices, made.faces)


@settings(deadline=None)
@given(st.floats(0.05, 0.8))
def test_no_vertex_leaves_its_cell_and_no_face_is_added(cell):
    mesh = ball()
    coarse = clustered(mesh, cell)
    assert len(coarse.faces) <= len(mesh.faces)
    moved = np.linalg.norm(mesh.vertices[:, None] - coarse.vertices[None], axis=2).min(axis=1)
    assert moved.max() <= cell * np.sqrt(3) + 1e-12
    assert len(np.unique(np.floor(coarse.vertices / cell), axis=0)) == len(coarse.vertices)


def test_a_coarser_grid_leaves_fewer_faces_and_no_face_twice():
    mesh = ball()
    counts = [len(clustered(mesh, cell).faces) for cell in (0.01, 0.2, 0.4, 0.8)]
    assert counts == sorted(counts, reverse=True) and counts[0] == len(mesh.faces) > counts[-1] >= 4
    faces = np.sort(clustered(mesh, 0.4).faces, axis=1)
    assert len(np.unique(faces, axis=0)) == len(faces) and (np.diff(faces, axis=1) > 0).all()


def test_a_mesh_that_the_grid_would_swallow_stays_as_it_was():
    mesh = TriangleMesh(ball().vertices + 2.0, ball().faces)
    assert clustered(mesh, 100.0) is mesh


@pytest.mark.parametrize("cell", [0.0, -1.0, float("nan"), float("inf")])
def test_a_cell_that_is_no_length_is_refused(cell):
    with pytest.raises(TradeoffError, match="no length"):
        clustered(ball(), cell)


def test_an_assembly_keeps_poses_and_pairs(bumped):
    from replay.prepare.assemble import assemble

    assembly = assemble(bumped)
    coarse = coarser(assembly, 0.5)
    assert coarse.motion is assembly.motion and coarse.pairs is assembly.pairs and coarse.names == assembly.names
