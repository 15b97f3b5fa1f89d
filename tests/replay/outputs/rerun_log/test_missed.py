"""Red faces are those of the misses, in the body's frame; pins and flags agree with the list."""

import numpy as np
import pytest
from support.small_worlds import jumping

from replay.outputs.rerun_log.scene import LARGE_FACE, PUSHED_OUT, face_areas
from replay.pipeline.engine import compute

SUBJECT, ORACLE = "22.5Hz", "hybrid"


@pytest.mark.parametrize("body", ["beaker", "rod"])
def test_red_faces_are_those_that_met_unseen_and_no_frame_else_has_any(demo, read, body):
    number = demo.assembly.names.index(body)
    mesh = demo.assembly.bodies[number].mesh
    missed = {}
    for one in demo.misses[SUBJECT]:
        ends = demo.assembly.pairs[one.pair].tolist()
        for frame in range(one.first, one.last + 1):
            if number in ends:
                faces = np.unique(demo.detections[ORACLE].faces(frame, one.pair)[:, ends.index(number)])
                small = faces[face_areas(mesh, faces) <= LARGE_FACE]
                missed.setdefault(frame, set()).update(small.tolist())
    assert missed
    for frame in range(len(demo.assembly.motion)):
        corners = np.array(read.at(f"world/{body}/missed_faces", "Mesh3D:vertex_positions", frame)).reshape(-1, 3, 3)
        wanted = mesh.triangles[sorted(missed.get(frame, ()))]
        assert corners.shape == wanted.shape, frame
        assert np.abs(corners - wanted).max(initial=0.0) < PUSHED_OUT + 1e-6


def test_a_miss_between_frames_shows_the_faces_that_touch_first_at_that_moment_alone(passed, passed_read):
    (one,) = passed.misses["exact"]
    assert one.touch is not None
    moment = 10_000_000 * one.touch.frame + one.touch.later_ns
    for body, face in zip(("a", "b"), one.touch.faces, strict=True):
        seen = [
            np.array(passed_read.at_ns(f"world/{body}/missed_faces", "Mesh3D:vertex_positions", ns))
            for ns in (moment - 1, moment, 20_000_000)
        ]
        assert [len(corners) for corners in seen] == [0, 3, 0]
        assert np.allclose(
            seen[1], passed.assembly.bodies[passed.assembly.names.index(body)].mesh.triangles[face], atol=2e-4
        )


def test_where_the_oracle_lists_no_faces_a_miss_that_frames_show_has_red_ones_at_its_deepest(drawn):
    session = jumping([3, 3, 3, 0.9, 3, 3, 3, 3])
    seen = drawn(compute(session, detectors="slow=discrete[rate_hz=20]", oracle="continuous"))
    counts = [len(seen.at("world/b/missed_faces", "Mesh3D:vertex_positions", frame)) for frame in range(8)]
    assert max(counts) > 3 and sum(count > 0 for count in counts) == 1
