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
    """A row has the call (``of``), its arguments, and words of the refusal, which is one line."""
    error, call = CALLS[row["of"]]
    with pytest.raises(error, match=row["words"]) as refused:
        call(**{name: value for name, value in row.items() if name not in ("of", "words")})
    assert str(refused.value).isprintable()
