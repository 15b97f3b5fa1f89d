"""The three public A-Frame recordings, with a VIVE wand on both controllers, touch in exactly the frames stated."""

import json

import fcl
import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation
from support.shared_data import DATA, needs_data

from replay.cli.main import main
from sessions.importers import import_session

WAND = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
CAPTURES = DATA / "aframe-motion-capture"

TRUTH = {
    "grabLeft": (1127, 59, [(195, 278)]), "grabRight": (1436, 121, []),
    "tracked-recording": (2568, 114, [(140, 155), (2124, 2567)]),
}  # fmt: skip
"""Recording -> frames, gaps over 1.5 times the median step, first and last frame of each contact episode.

Source: README.md beside the recordings.
"""

pytestmark = [needs_data, pytest.mark.slow]


def fcl_mesh(mesh):
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices), len(mesh.faces))
    model.addSubModel(mesh.vertices, mesh.faces)
    model.endModel()
    return fcl.CollisionObject(model)


def touching_frames(session, a, b):
    """A plain loop: place both meshes at every frame as recorded and ask."""
    frames, columns = session.frames, [session.names.index(name) for name in (a, b)]
    objects = [fcl_mesh(session.meshes[name]) for name in (a, b)]
    turns = [Rotation.from_quat(frames.quaternion_xyzw[:, column]).as_matrix() for column in columns]
    found = []
    for frame in range(len(frames)):
        for body, turn, column in zip(objects, turns, columns, strict=True):
            body.setTransform(fcl.Transform(turn[frame], frames.position[frame, column]))
        if fcl.collide(*objects, fcl.CollisionRequest(), fcl.CollisionResult()):
            found.append(frame)
    return np.array(found, dtype=np.int64)


def episodes(frames):
    starts = np.flatnonzero(np.diff(frames, prepend=-2) > 1)
    ends = [*(starts[1:] - 1), len(frames) - 1] if len(frames) else []
    return [(int(frames[start]), int(frames[end])) for start, end in zip(starts, ends, strict=True)]


@pytest.mark.parametrize("name", TRUTH)
def test_wands_touch_in_exactly_the_stated_frames(name):
    count, gaps, truth = TRUTH[name]
    session = import_session("aframe", CAPTURES / f"{name}.json", meshes={"left": WAND, "right": WAND})
    assert len(session.frames) == count
    steps = np.diff(session.frames.stamp_ns)
    assert int((steps > 1.5 * np.median(steps)).sum()) == gaps
    assert sorted(session.names) == ["camera", "left", "right"]
    assert len(session.meshes["left"].faces) == 17_344
    assert not any(body.proxy for body in session.scene.bodies)
    assert episodes(touching_frames(session, "left", "right")) == truth


@pytest.mark.parametrize("name", TRUTH)
def test_imported_and_run_from_the_command_line_it_has_exactly_the_contact_frames_stated(name, tmp_path, capsys):
    truth = TRUTH[name][2]
    session, out = tmp_path / "s.mcap", tmp_path / "run"
    meshes = [f"--mesh={side}={WAND}" for side in ("left", "right")]
    assert main(["import", "aframe", str(CAPTURES / f"{name}.json"), "-o", str(session), *meshes]) == 0
    assert main(["run", str(session), "-o", str(out), "--no-picture", "--detectors", "hybrid,discrete"]) == 0
    assert "proxy" not in capsys.readouterr().out.lower()
    counts = json.loads((out / "summary.json").read_text())
    for label in counts["detectors"]:
        rows = [row for row in pq.read_table(out / "episodes.parquet").to_pylist() if row["detector"] == label]
        assert [(row["first"], row["last"]) for row in rows] == truth, label
        assert all({row["body_a"], row["body_b"]} == {"left", "right"} for row in rows)
    frames = pq.read_table(out / "frames.parquet").to_pylist()
    assert [row["frame"] for row in frames] == [t for first, last in truth for t in range(first, last + 1)]
