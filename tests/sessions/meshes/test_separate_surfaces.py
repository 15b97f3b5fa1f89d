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


LID = shifted_mesh(make_shape("cylinder", {"radius": 0.04, "length": 0.01}, 200), 0, 0.095, 0)
"""3 cm above the jar."""
INNER_WALL = MeshData(0.9 * JAR.vertices, JAR.faces[:, ::-1])


@pytest.mark.parametrize(
    ("meshes", "surfaces", "gap_m"),
    [
        pytest.param([JAR, shifted_mesh(JAR, 2.08, 0, 0)], 2, 2.0, id="two jars, 2.08 m less two radii of 4 cm"),
        pytest.param([TUBE, shifted_mesh(TUBE, 0.116, 0, 0)], 2, 0.1, id="two tubes, 116 mm less two radii of 8 mm"),
        pytest.param(
            [TUBE, shifted_mesh(TUBE, 0.3, 0, 0), shifted_mesh(TUBE, 0, 0, 0.4)], 3, 0.284, id="three, the least gap"
        ),
        pytest.param([JAR, shifted_mesh(CRUMB, 1, 1, 1)], 2, 1.67, id="a face that was forgotten"),
        # Gaps are searched in some directions: along (0, 1, 1) the offset (1, 2, 4) is 6 / sqrt(2) long.
        pytest.param([CRUMB, shifted_mesh(CRUMB, 1, 2, 4)], 2, 6 / np.sqrt(2), id="two points from all sides"),
        pytest.param([JAR, LID], 1, 0.0, id="a jar and its lid"),
        pytest.param([JAR, INNER_WALL], 1, 0.0, id="a wall within a wall"),
        pytest.param([JAR, shifted_mesh(JAR, 0.09, 0, 0)], 1, 0.0, id="two jars, 1 cm from each other"),
    ],
)
def test_distant_surfaces_are_counted_with_their_distance(meshes, surfaces, gap_m):
    """A mesh has surfaces that do not touch; far apart, for their own sizes, they are likely of several bodies.

    The number is the same in rotated axes, and the doctor reports it where it is over 1. The gap is measured in 13
    directions, within 3 %.
    """
    mesh = concatenated_meshes(meshes)
    count, distance = separate_surfaces(mesh)
    assert count == surfaces
    assert distance == pytest.approx(gap_m, rel=0.03)
    any_rotation, _ = np.linalg.qr(np.arange(9.0).reshape(3, 3) + np.eye(3))
    count_in_rotated_axes, _distance = separate_surfaces(MeshData(mesh.vertices @ any_rotation, mesh.faces))
    assert count_in_rotated_axes == surfaces
    codes = [finding.code for finding in mesh_findings("jar", mesh)]
    assert codes.count("mesh-apart") == (surfaces > 1)


def test_search_ends_at_the_largest_number_of_groups():
    """Twenty crumbs more than MOST_GROUPS lie on a line, each 1.2 times as far away as the crumb before.

    Gaps are found from the farthest on: the first 21 crumbs stay one group, and the least gap is behind the last of it.
    """
    crumbs = [shifted_mesh(CRUMB, 1.2**number, 0, 0) for number in range(MOST_GROUPS + 20)]
    count, distance = separate_surfaces(concatenated_meshes(crumbs))
    assert count == MOST_GROUPS
    assert distance == pytest.approx(1.2**21 - 1.2**20, rel=0.01)


def test_instruments_and_devices_of_others_are_one_surface():
    """Three instruments of the product's catalogue, and files of other programs where these are at hand, are whole.

    Whatever pieces they have, none is so far from the others that it is a second surface.
    """
    meshes = [make_instrument(name, 500).mesh for name in ("beaker_250", "hand_left", "proxy_wand")]
    meshes += [load_mesh(file) for file in (*DATA.rglob("*.obj"), *DATA.rglob("htc*.glb"))]
    for mesh in meshes:
        surfaces, _distance = separate_surfaces(mesh)
        assert surfaces == 1
