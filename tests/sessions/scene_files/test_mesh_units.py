import numpy as np
import pytest
import trimesh

from sessions.mesh_data import MeshData
from sessions.meshes.conventions import CONVENTIONS
from sessions.meshes.mesh_match import UNITS
from sessions.model.assumption import Confidence, Origin, Subject
from sessions.model.scene import SceneBody
from sessions.scene_files.mesh_units import mesh_unit, scene_mesh_unit, units_beside_others


def box_mesh_of(*size):
    """A box of this size."""
    box = trimesh.creation.box(size)
    return MeshData(np.asarray(box.vertices), np.asarray(box.faces))


@pytest.mark.parametrize(
    ("file", "scale", "size", "value", "origin", "alternatives"),
    [
        ("cup.obj", 0.001, 0.1, "mm", Origin.USER, ("mm",)),
        ("cup.obj", 0.0254, 0.1, "inch", Origin.USER, ("inch",)),
        ("cup.obj", 0.02, 0.1, "0.02 m", Origin.USER, ("0.02 m",)),
        ("cup.glb", 1.0, 0.1, "m", Origin.FORMAT, ("m",)),
        ("cup.obj", 1.0, 0.1, "m", Origin.GUESS, ("m",)),
        ("cup.obj", 1.0, 120.0, "m", Origin.GUESS, ("m", "cm", "mm")),
        ("cup.stl", 1.0, 12.0, "m", Origin.GUESS, ("m", "cm", "mm")),
    ],
)
def test_mesh_unit_is_stated_by_scene_or_guessed(file, scale, size, value, origin, alternatives):
    """A cube of ``size`` m was read by ``scale``: other than 1 it is the scene's word, and of a GLB the format's.

    Of an OBJ or STL metres are guessed; ``alternatives``: the units by which the cube is 5 mm to 5 m wide, too.
    """
    row = scene_mesh_unit(SceneBody("cup", mesh=file, scale=scale), box_mesh_of(size, size, size))
    assert (row.subject, row.value, row.origin) == (Subject.MESH_UNIT, value, origin)
    assert row.alternatives == alternatives
    assert (row.confidence is Confidence.OPEN) == (len(alternatives) > 1)


def guessed_alternatives(sizes, stated=()):
    """Body -> units that its OBJ file may have; ``sizes``: body -> (how many units its cube is wide, unit taken).

    The user says the units of the bodies ``stated``.
    """
    meshes = {name: box_mesh_of(*[size * UNITS[unit]] * 3) for name, (size, unit) in sizes.items()}
    poses = CONVENTIONS["canonical"]
    rows = {
        name: mesh_unit(f"{name}.obj", meshes[name], unit, poses, stated_by=Origin.USER if name in stated else None)
        for name, (_, unit) in sizes.items()
    }
    return {row.bodies[0]: row.alternatives for row in units_beside_others(rows, meshes)}


@pytest.mark.parametrize("millimetres", [5, 6, 7.5, 8, 9, 30])
def test_a_lone_mesh_of_millimetres_in_centimetres_is_open(millimetres):
    """A cube is 0.5 to 3 units wide: taken for metres, it may as well be in centimetres, by which it has 5 to 30 mm.

    Meshes have 5 mm to 5 m, so that it is not in millimetres.
    """
    assert guessed_alternatives({"stopper": (millimetres / 10, "m")})["stopper"] == ("m", "cm")


def test_two_meshes_of_unclear_unit_both_stay_unclear():
    """Meshes of 0.8 and 0.9 m may be large or in centimetres; neither is evidence for the other."""
    alternatives = guessed_alternatives({"stopper": (0.8, "m"), "lid": (0.9, "m")})
    assert alternatives == {"stopper": ("m", "cm"), "lid": ("m", "cm")}


def test_a_certain_mesh_of_its_unit_decides_a_bench():
    """A bench of 0.8 units may be in centimetres alone, not beside a cup that is 0.1 m for sure."""
    assert guessed_alternatives({"bench": (0.8, "m"), "cup": (0.1, "m")})["bench"] == ("m",)


def test_a_bench_beside_meshes_in_centimetres_is_open():
    """A bench of 0.8 units is beside a cup of 12 units, of which the user says that they are centimetres.

    So it may be large, in metres as taken, or 8 mm, in the cup's unit.
    """
    assert guessed_alternatives({"bench": (0.8, "m"), "cup": (12.0, "cm")}, stated=["cup"])["bench"] == ("m", "cm")


def test_pin_beside_centimetre_meshes_may_be_smaller():
    """A pin of 0.2 units, by itself metres, is beside a cup of 12 cm: it may be 2 mm, also beside meshes in metres."""
    pin_and_cup = {"pin": (0.2, "m"), "cup": (12.0, "cm")}
    assert guessed_alternatives(pin_and_cup)["pin"] == ("m", "cm")
    more_in_metres = {"dish": (0.1, "m"), "tube": (0.1, "m")}
    assert guessed_alternatives(pin_and_cup | more_in_metres)["pin"] == ("m", "cm")


def test_unit_of_the_poses_is_a_possible_unit_of_meshes():
    """A pin is 0.2 units long, taken for metres, beside poses of Unreal, whose lengths are in centimetres.

    It would be 2 mm long, too short for a mesh by itself (5 mm), but not in the unit of the poses (1 mm).
    """
    row = mesh_unit("pin.obj", box_mesh_of(0.2, 0.2, 0.2), unit="m", poses=CONVENTIONS["unreal"])
    assert row.alternatives == ("m", "cm")
    assert row.is_open
