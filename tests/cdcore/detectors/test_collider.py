from dataclasses import replace

import pytest
from support.shapes import box_mesh

from cdcore import Body, create_detector
from cdcore.errors import InvalidSettingError
from cdcore.protocol import Solids

PIECE = box_mesh((0.5, 0.5, 0.5))
BODIES = [Body("in pieces", box_mesh(), Solids((PIECE, PIECE), PIECE)), Body("whole", box_mesh())]


@pytest.mark.parametrize(
    ("shape", "counts", "width_m"), [("shipped", [2, 1], 0.5), ("hull", [1, 1], 1.0), ("box", [1, 1], 1.0)]
)
def test_only_shape_shipped_takes_pieces_of_the_body(shape, counts, width_m):
    """Shipped are two pieces of 0.5 m for the first body; hull and box are made of its mesh of 1 m."""
    solids = create_detector("collider", BODIES, shape=shape).parts
    assert [len(solids[body.name]) for body in BODIES] == counts
    assert solids["in pieces"][0].vertices[:, 0].max() == pytest.approx(width_m / 2)


def test_compound_of_a_body_without_pieces_is_refused():
    """Two bodies with two pieces each are accepted; beside one without pieces they are not."""
    in_pieces, whole = BODIES
    other = replace(in_pieces, name="other")
    assert len(create_detector("collider", [in_pieces, other], shape="compound").parts["other"]) == 2
    with pytest.raises(InvalidSettingError, match="whole has no convex pieces"):
        create_detector("collider", [in_pieces, whole], shape="compound")
