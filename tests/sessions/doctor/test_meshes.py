import numpy as np
import pytest
from support.planted_faults import clean
from support.small_worlds import cube

from sessions import MeshData, Scene, Severity
from sessions.doctor.meshes import all_mesh_findings, degenerate_faces, duplicate_faces, mesh_findings
from sessions.doctor.pose_pass import look_through
from sessions.doctor.scale import roles_of, scale_findings, unit_guess
from sessions.errors import MeshFileError
from sessions.glassware.catalogue import make_instrument
from sessions.model.scene import SceneBody


def codes(mesh):
    return {one.code: one.count for one in mesh_findings("m", mesh)}


def test_a_closed_cube_has_nothing_wrong():
    assert codes(cube()) == {}


@pytest.mark.parametrize("name", ["beaker_250", "erlenmeyer_flask", "hand_left"])
def test_the_glass_of_the_bench_has_nothing_above_a_note(name):
    found = [*mesh_findings(name, make_instrument(name, 1500).mesh)]
    assert [one for one in found if one.severity > Severity.NOTE] == []


def test_each_fault_of_a_mesh_is_counted():
    mesh = cube()
    assert codes(MeshData(mesh.vertices, mesh.faces[1:])) == {"mesh-open": 3}
    assert codes(MeshData(mesh.vertices, [*mesh.faces, mesh.faces[0]]))["mesh-duplicate"] == 1
    assert codes(MeshData(mesh.vertices, [*mesh.faces, mesh.faces[0]]))["mesh-non-manifold"] == 3
    assert codes(MeshData(mesh.vertices, [*mesh.faces, [0, 0, 1]])) == {"mesh-degenerate": 1}
    assert codes(MeshData(mesh.vertices, [*mesh.faces[:-1], mesh.faces[-1][::-1]])) == {"mesh-winding": 3}
    assert codes(MeshData(mesh.vertices * [1, 1, -1], mesh.faces)) == {"mesh-mirrored": 12}
    assert codes(MeshData(mesh.vertices * 1e3, mesh.faces)) == {"mesh-units": 1}


def test_vertices_that_an_exporter_split_are_one_place():
    mesh = cube()
    split = MeshData(mesh.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert codes(split) == {}


def test_needles_are_no_points_and_doubles_in_any_order_are_doubles():
    needle = MeshData([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0], [0.5, 0, 0]], [[0, 1, 2], [0, 1, 3], [1, 0, 2]])
    assert degenerate_faces(needle).tolist() == [False, True, False]
    assert duplicate_faces(needle) == 2 or duplicate_faces(needle) == 1


def test_a_mesh_that_cannot_be_loaded_is_a_finding():
    class Broken(dict):
        def __getitem__(self, name):
            raise MeshFileError("the mesh is gone; find it")

    (one,) = all_mesh_findings(Broken(a=None))
    assert (one.code, one.body, one.severity) == ("mesh-unreadable", "a", Severity.ERROR)


def test_heads_and_hands_are_told_by_their_names_and_nothing_else_is():
    roles = roles_of(("camera", "leftHand", "right", "beaker-left", "rod"), Scene())
    assert (roles.head, roles.left, roles.right) == (0, 1, 2)
    roles = roles_of(("flask", "hand-right", "headset"), Scene(bodies=(SceneBody("headset", parent="flask"),)))
    assert (roles.head, roles.left, roles.right) == (None, None, 1)


@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres")])
def test_other_units_are_named(factor, unit):
    draft = clean()
    draft.arrays["position"][:, 1] *= factor
    looked = look_through([draft.session().frames])
    (one,) = scale_findings(looked, Scene(), {})
    assert (one.code, one.body) == ("unit-suspect", "hand-left")
    assert unit_guess(looked, 1) is not None and unit_guess(looked, 0) is None
    assert unit in one.message or unit == "centimetres"


def test_a_child_is_not_judged_by_where_it_is_in_its_parent():
    draft = clean()
    draft.arrays["position"][:, 1] *= 1000
    scene = Scene(bodies=(SceneBody("hand-left", parent="tray"),))
    assert [*scale_findings(look_through([draft.session().frames]), scene, {})] == []


def test_a_head_below_the_hands_is_named():
    looked = look_through([clean().session().frames])
    names = {"flask": "hmd", "hand-left": "hand-left", "tray": "tray"}
    looked = type(looked)(tuple(names[name] for name in looked.names), *list(vars(looked).values())[1:])
    (one,) = scale_findings(looked, Scene(), {})
    assert (one.code, one.body) == ("head-below-hands", "hmd")


def test_facts_that_admit_a_left_handed_source_are_believed():
    looked = look_through([clean().session().frames])
    assert [one.code for one in scale_findings(looked, Scene(), {"handedness": "left"})] == ["handedness"]
    told = {"handedness": "left", "conversions": "handedness mirrored along Z"}
    assert [*scale_findings(looked, Scene(), told)] == []
    assert np.isfinite(looked.position).all()
