"""Arrays that are none of what they are given for, rows of `bad_input.toml`: each is refused in one sentence."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.shapes import box_mesh

from cdcore import Body, Motion, TriangleMesh
from cdcore.errors import InvalidMeshError, InvalidPairError, InvalidPoseError
from cdcore.protocol import resolve_pairs

TABLE = tomllib.loads(Path(__file__).with_name("bad_input.toml").read_text("utf-8"))["refused"]
TIMES = np.arange(6) / 90
BODIES = [Body(name, box_mesh()) for name in ("table", "rod", "cup")]


def zeros(shapes):
    """Arrays of zeros with these shapes; text stays text."""
    return {name: shape if isinstance(shape, str) else np.zeros(shape) for name, shape in shapes.items()}


CALLS = {
    "mesh": (InvalidMeshError, lambda **arrays: TriangleMesh(**arrays)),
    "times": (InvalidPoseError, lambda times: Motion(times, np.zeros((6, 2, 3)), np.tile(np.eye(3), (6, 2, 1, 1)))),
    "shapes": (InvalidPoseError, lambda **shapes: Motion(TIMES, **zeros(shapes))),
    "matrices": (InvalidPoseError, lambda **shapes: Motion.from_matrices(TIMES, **zeros(shapes))),
    "quaternions": (InvalidPoseError, lambda **shapes: Motion.from_quaternions(TIMES, **zeros(shapes))),
    "pairs": (InvalidPairError, lambda pairs: resolve_pairs(BODIES, pairs)),
}


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row['of']}: {row['words']}")
def test_invalid_arrays_are_refused_in_a_sentence(row):
    """A row of bad_input.toml names a call in ``of``, a pattern of the error's text in ``words``; the rest are
    arguments.

    ``mesh`` with three vertices and faces [[0, 1, 3]], for instance: "there are only vertices 0 to 2". The text is one
    line.
    """
    arguments = dict(row)
    error, call = CALLS[arguments.pop("of")]
    pattern = arguments.pop("words")
    with pytest.raises(error, match=pattern) as refusal:
        call(**arguments)
    assert str(refusal.value).isprintable(), "a line break is not printable"
