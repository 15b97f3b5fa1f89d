import pytest
from support.shapes import box_mesh, revolved_mesh

from cdcore import TriangleMesh
from replay.cutting.methods import method_of

CUP = revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)], 12)


@pytest.mark.parametrize(
    ("name", "mesh", "method"),
    [
        ("auto", CUP, "sectors"),
        ("auto", TriangleMesh(CUP.vertices, CUP.faces[1:]), "vhacd"),
        ("auto", box_mesh((1.0, 2.0, 3.0)), "vhacd"),
        ("coacd", CUP, "coacd"),
    ],
    ids=["round", "round and open", "not round", "named"],
)
def test_only_closed_round_bodies_are_cut_in_sectors_by_themselves(name, mesh, method):
    """``auto`` chooses the method by the body; a cup is round and closed, and open without its first face."""
    assert method_of(name, mesh) == method
