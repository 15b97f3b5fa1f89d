import pytest
from support.shapes import box_mesh, revolved_mesh

from cdcore import TriangleMesh
from replay.cutting.methods import method_of

CUP = revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)], 12)
"""A body of revolution with a floor and a wall of 2 mm, of (radius, height) in metres, with 12 sides."""


@pytest.mark.parametrize(
    ("requested", "mesh", "method"),
    [
        pytest.param("auto", CUP, "sectors", id="round"),
        pytest.param("auto", TriangleMesh(CUP.vertices, CUP.faces[1:]), "vhacd", id="round, a face missing"),
        pytest.param("auto", box_mesh((1.0, 2.0, 3.0)), "vhacd", id="not round"),
        pytest.param("coacd", CUP, "coacd", id="round, another method requested"),
    ],
)
def test_only_closed_round_bodies_are_cut_in_sectors_by_themselves(requested, mesh, method):
    """``auto`` chooses the method of cutting a body into convex pieces by the body: a cup, or a box."""
    assert method_of(requested, mesh) == method
