from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdcore import TriangleMesh
from cdcore.detectors import DETECTORS, load_detector
from replay.errors import TradeoffError
from replay.tradeoffs.decimation import clustered, coarser
from replay.tradeoffs.settings import ASKED, settings_list


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
