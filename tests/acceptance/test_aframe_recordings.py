"""The three public A-Frame recordings, with a VIVE wand on both controllers, touch in exactly the frames stated."""

import json

import pyarrow.parquet as pq
import pytest
from support.optional import DATA, needs_data

from replay.cli.console import EXIT_OK
from replay.cli.main import main

WAND = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
CAPTURES = DATA / "aframe-motion-capture"

TRUTH = {
    "grabLeft": (1127, [(195, 278)]),
    "grabRight": (1436, []),
    "tracked-recording": (2568, [(140, 155), (2124, 2567)]),
}
"""Recording -> number of frames, and first and last frame of each contact of both controllers.

Source: README.md beside the recordings, by a plain loop over python-fcl.
"""

pytestmark = [needs_data, pytest.mark.slow]


@pytest.mark.parametrize("name", TRUTH)
def test_imported_recording_has_exactly_the_stated_contact_frames(name, tmp_path, capsys):
    """A recording is imported with a wand's mesh for either controller and run with two detectors and the reference.

    Each of the three reports exactly the contacts of TRUTH, and the table of frames lists their frames. The wands
    themselves are tested: the run says nothing of stand-ins ("proxy").
    """
    frame_count, contacts = TRUTH[name]
    session, out = tmp_path / "s.mcap", tmp_path / "run"
    meshes = [f"--mesh={side}={WAND}" for side in ("left", "right")]
    assert main(["import", "aframe", str(CAPTURES / f"{name}.json"), "-o", str(session), *meshes]) == EXIT_OK
    assert main(["run", str(session), "-o", str(out), "--no-picture", "--detectors", "hybrid,discrete"]) == EXIT_OK
    assert "proxy" not in capsys.readouterr().out.lower()

    summary = json.loads((out / "summary.json").read_text())
    assert summary["session"]["frames"] == frame_count
    assert summary["detectors"].keys() == {"hybrid", "discrete", "exact"}
    episodes = pq.read_table(out / "episodes.parquet").to_pylist()
    for label in summary["detectors"]:
        rows = [row for row in episodes if row["detector"] == label]
        assert [(row["first"], row["last"]) for row in rows] == contacts, label
        assert all({row["body_a"], row["body_b"]} == {"left", "right"} for row in rows)
    frames = pq.read_table(out / "frames.parquet").to_pylist()
    contact_frames = [frame for first, last in contacts for frame in range(first, last + 1)]
    assert [row["frame"] for row in frames] == contact_frames
