"""The doctor reports what is wrong with recordings and meshes that others made; pieces of two are in the repository."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.optional import DATA, needs_data

from sessions import Session, Severity, examine, import_session, write_session

PIECES = Path(__file__).parents[1] / "recordings"
CAPTURES = DATA / "aframe-motion-capture"
TRACKER = DATA / "vive-accuracy" / "measurementPoint3.txt"
by_tracker_log = pytest.mark.parametrize(
    "log", [PIECES / "vive_tracker_at_rest.txt", pytest.param(TRACKER, marks=needs_data)], ids=["piece", "whole"]
)
by_piece_and_whole_of_a_capture = pytest.mark.parametrize(
    "capture",
    [PIECES / "two_controllers.json", pytest.param(CAPTURES / "tracked-recording.json", marks=needs_data)],
    ids=["piece", "whole"],
)


def findings_with_code(findings, code, body=None):
    """Findings of this code, of one body or of all."""
    return [item for item in findings if item.code == code and body in (None, item.body)]


STEP_OF_LOG_NS = 4_000_000
"""250 rows a second, by the header of the log."""


@by_tracker_log
def test_vive_log_has_159_identity_rows_and_a_jump(log, tmp_path):
    """A log of a tracker at rest: 3 columns of position, 4 of a quaternion, w first; a lost tracker is at the origin.

    The 159 rows of zeros are a finding from the first to the last of them; it jumps there from 2.93 m away and back.
    Nothing else is above a note but that the tracker has no mesh.
    """
    table = np.loadtxt(log, skiprows=1)
    position, quaternion_xyzw = table[:, :3], table[:, [4, 5, 6, 3]]
    session = Session.from_arrays(np.arange(len(table)) * STEP_OF_LOG_NS, {"tracker": (position, quaternion_xyzw)})
    write_session(session, tmp_path / "vive.mcap")
    findings = examine(tmp_path / "vive.mcap")

    (lost,) = findings_with_code(findings, "identity-while-lost")
    rows_of_zeros = np.flatnonzero((position == 0).all(axis=1))
    assert (lost.body, lost.count, lost.severity) == ("tracker", 159, Severity.ERROR)
    assert lost.start_ns == int(rows_of_zeros[0]) * STEP_OF_LOG_NS
    assert lost.end_ns == int(rows_of_zeros[-1]) * STEP_OF_LOG_NS

    away, back = sorted(findings_with_code(findings, "teleport"), key=lambda item: item.start)
    assert away.start_ns == lost.start_ns and back.start_ns == lost.end_ns + STEP_OF_LOG_NS
    assert "2.93 m in one step" in (away.message, back.message)

    codes = {item.code for item in findings if item.severity > Severity.NOTE}
    assert codes == {"identity-while-lost", "teleport", "no-mesh"}


@by_piece_and_whole_of_a_capture
def test_right_hand_of_the_long_capture_is_frozen_74_frames(capture):
    """The right hand keeps the position of the frame before for 74 frames, as the finding says, and no longer.

    They are in the piece of the capture that comes with the tests, and in the whole.
    """
    session = import_session("aframe", capture)
    (frozen,) = findings_with_code(examine(session), "frozen")
    assert (frozen.body, frozen.count) == ("right", 74)
    position = session.frames.position[:, session.names.index("right")]
    stamps = session.frames.stamp_ns
    first, last = np.searchsorted(stamps, [frozen.start_ns, frozen.end_ns])
    assert last - first + 1 == frozen.count
    assert (position[first - 1 : last + 1] == position[first]).all()
    assert (position[first - 2] != position[first]).any()
    assert (position[last + 1] != position[last]).any()


@by_piece_and_whole_of_a_capture
def test_capture_arrives_with_its_positions_and_stamps(capture):
    """Positions of a camera and two controllers are the numbers in the file, bit by bit, where there are any.

    From the first stamp to the last it is as long as written, milliseconds to a microsecond.
    """
    session = import_session("aframe", capture)
    assert set(session.names) == {"camera", "left", "right"}
    for name, track in json.loads(capture.read_text("utf-8")).items():
        positions = session.frames.position[:, session.names.index(name)]
        written = [[pose["position"][axis] for axis in "xyz"] for pose in track["poses"]]
        assert np.array_equal(positions[~np.isnan(positions).any(axis=1)], written)
        stamps_ms = [pose["timestamp"] for pose in track["poses"]]
        assert np.ptp(session.frames.stamp_ns) * 1e-6 == pytest.approx(stamps_ms[-1] - stamps_ms[0], abs=1e-3)


@needs_data
def test_no_capture_is_taken_for_a_broken_capture():
    """Recordings of people: nothing above a warning, and no doubt about units, handedness or the axis that is up."""
    files = [*CAPTURES.glob("*.json"), *(DATA / "a-saturday-night").glob("*.json")]
    assert files
    for file in files:
        findings = examine(import_session("aframe", file))
        assert [item for item in findings if item.severity > Severity.WARNING] == []
        assert {item.code for item in findings}.isdisjoint({"unit-suspect", "handedness", "up-axis"})


@needs_data
@pytest.mark.parametrize(
    ("folder", "name", "code", "count"),
    [
        ("trimesh-models", "chair_model.obj", "mesh-duplicate", 6382),
        ("trimesh-models", "joined_tetrahedra.obj", "mesh-duplicate", 1),
        ("trimesh-models", "soup.stl", "mesh-open", 300),
        ("trimesh-models", "teapot.stl", "mesh-open", 64),
        ("trimesh-models", "not_convex.obj", "mesh-non-manifold", 12),
        # of its six parts in their own frames; placed by rounded poses, eight edges of two parts seem to be shared
        ("webxr-vive-controller", "htc-vive-none.glb", "mesh-open", 256),
        ("sweethome3d-vessels", "cc0/plasticCup.obj", "mesh-degenerate", 512),
    ],
)
def test_the_meshes_have_the_faults_their_notes_count(folder, name, code, count):
    """``count``: how often the fault ``code`` occurs in a file of others, by the notes beside it.

    The file stands in the folder or in one below.
    """
    path = DATA / folder / name
    if not path.exists():
        (path,) = (DATA / folder).rglob(path.name)
    (finding,) = findings_with_code(examine(path), code)
    assert (finding.body, finding.count) == (path.stem, count)
