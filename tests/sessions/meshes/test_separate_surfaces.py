"""Surfaces far apart in one mesh are told from lids, walls within walls and the parts of a device."""

import numpy as np
import pytest
from support.optional import DATA

from sessions import load_mesh, make_shape
from sessions.doctor.meshes import mesh_findings
from sessions.glassware.catalogue import make_instrument
from sessions.mesh_data import MeshData, concatenated_meshes
from sessions.meshes.separate_surfaces import MOST_GROUPS, separate_surfaces

JAR = make_shape("cylinder", {"radius": 0.04, "length": 0.12}, 200)
TUBE = make_shape("cylinder", {"radius": 0.008, "length": 0.15}, 200)
CRUMB = MeshData(np.eye(3) * 1e-3, [[0, 1, 2]])


def shifted_mesh(mesh, *offset):
    """The mesh moved by an offset."""
    return MeshData(mesh.vertices + np.array(offset), mesh.faces)


@pytest.mark.parametrize(
    ("meshes", "surfaces", "gap"),
    [
        ([JAR, shifted_mesh(JAR, 2.08, 0, 0)], 2, 2.0),
        ([TUBE, shifted_mesh(TUBE, 0.116, 0, 0)], 2, 0.1),
        ([TUBE, shifted_mesh(TUBE, 0.3, 0, 0), shifted_mesh(TUBE, 0, 0, 0.4)], 3, 0.284),
        ([JAR, shifted_mesh(CRUMB, 1, 1, 1)], 2, 1.67),  # a face that was left over
        (
            [CRUMB, shifted_mesh(CRUMB, 1, 2, 4)],
            2,
            6 / np.sqrt(2),
        ),  # seen along (0, 1, 1); both are points from all sides
        (
            [JAR, shifted_mesh(make_shape("cylinder", {"radius": 0.04, "length": 0.01}, 200), 0, 0.095, 0)],
            1,
            0.0,
        ),  # a lid
        ([JAR, MeshData(0.9 * JAR.vertices, JAR.faces[:, ::-1])], 1, 0.0),
        ([JAR, shifted_mesh(JAR, 0.09, 0, 0)], 1, 0.0),
    ],
)
def test_distant_surfaces_are_counted_with_their_distance(meshes, surfaces, gap):
    """Jars with a radius of 4 cm, tubes of 8 mm: jars 2.08 m from middle to middle are 2 m apart."""
    mesh = concatenated_meshes(meshes)
    count, distance = separate_surfaces(mesh)
    assert count == surfaces and distance == pytest.approx(gap, rel=0.03)
    rotated = MeshData(mesh.vertices @ np.linalg.qr(np.arange(9.0).reshape(3, 3) + np.eye(3))[0], mesh.faces)
    assert separate_surfaces(rotated)[0] == surfaces
    codes = [finding.code for finding in mesh_findings("jar", mesh)]
    assert codes.count("mesh-apart") == (surfaces > 1)


def test_search_ends_at_the_largest_number_of_groups():
    """Crumbs each 1.2 times as far away as the one before are set apart from the farthest on."""
    crumbs = [shifted_mesh(CRUMB, 1.2**number, 0, 0) for number in range(MOST_GROUPS + 20)]
    count, distance = separate_surfaces(concatenated_meshes(crumbs))
    assert count == MOST_GROUPS
    assert distance == pytest.approx(1.2**21 - 1.2**20, rel=0.01)  # the first twenty-one stay one group


def test_instruments_and_devices_of_others_are_one_surface():
    """Three instruments, and files of other programs where they are at hand."""
    meshes = [make_instrument(name, 500).mesh for name in ("beaker_250", "hand_left", "proxy_wand")]
    files = [*DATA.rglob("*.obj"), *DATA.rglob("htc*.glb")]
    meshes += [load_mesh(file) for file in files]
    assert [separate_surfaces(mesh)[0] for mesh in meshes] == [1] * len(meshes)
