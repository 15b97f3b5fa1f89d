from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box_mesh

from cdcore import Body, create_detector
from cdcore.errors import InvalidSettingError
from cdcore.protocol import Solids

PIECE = box_mesh((0.5, 0.5, 0.5))
IN_PIECES = Body("in pieces", box_mesh(), Solids((PIECE, PIECE), PIECE))
"""A box of 1 m recorded with two convex colliders of 0.5 m."""
WHOLE = Body("whole", box_mesh())
"""A box of 1 m recorded without colliders."""


@pytest.mark.parametrize(("shape", "count", "width_m"), [("shipped", 2, 0.5), ("hull", 1, 1.0), ("box", 1, 1.0)])
def test_only_shape_shipped_takes_pieces_of_the_body(shape, count, width_m):
    """``shipped`` are the recorded colliders, two pieces of 0.5 m; ``hull`` and ``box`` are made of the mesh of 1 m."""
    colliders = create_detector("collider", [IN_PIECES, WHOLE], shape=shape).parts["in pieces"]
    assert len(colliders) == count
    assert [np.ptp(collider.vertices[:, 0]) for collider in colliders] == pytest.approx(count * [width_m])


@pytest.mark.parametrize("shape", ["shipped", "hull", "box"])
def test_body_recorded_without_pieces_has_a_single_collider(shape):
    """A box of 1 m is recorded as it is, beside another in pieces: its one collider is 1 m long."""
    (collider,) = create_detector("collider", [IN_PIECES, WHOLE], shape=shape).parts["whole"]
    assert np.ptp(collider.vertices[:, 0]) == pytest.approx(1.0)


def test_compound_takes_the_pieces_of_every_body():
    """Two bodies recorded with two convex pieces each."""
    other = replace(IN_PIECES, name="other")
    pieces_by_body = create_detector("collider", [IN_PIECES, other], shape="compound").parts
    assert {name: len(pieces) for name, pieces in pieces_by_body.items()} == {"in pieces": 2, "other": 2}


def test_compound_of_a_body_without_pieces_is_refused():
    """A body recorded with two convex pieces, and one without any."""
    with pytest.raises(InvalidSettingError, match="whole has no convex pieces"):
        create_detector("collider", [IN_PIECES, WHOLE], shape="compound")
