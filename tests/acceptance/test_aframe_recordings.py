"""The three public A-Frame recordings, with a VIVE wand on both controllers, touch in exactly the frames stated."""

import json

import pyarrow.parquet as pq
import pytest
from support.optional import DATA, needs_data

from replay.cli.main import main

WAND = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
CAPTURES = DATA / "aframe-motion-capture"

TRUTH = {
    "grabLeft": (1127, [(195, 278)]),
    "grabRight": (1436, []),
    "tracked-recording": (2568, [(140, 155), (2124, 2567)]),
}
"""Recording -> frames, and first and last frame of each contact.

Source: README.md beside the recordings, by a plain loop over python-fcl.
"""

pytestmark = [needs_data, pytest.mark.slow]


@pytest.mark.parametrize("name", TRUTH)
def test_imported_recording_has_exactly_the_stated_contact_frames(name, tmp_path, capsys):
    """Every detector of the run finds them, in both tables; the wands themselves are tested, no proxy for them."""
    count, truth = TRUTH[name]
    session, out = tmp_path / "s.mcap", tmp_path / "run"
    meshes = [f"--mesh={side}={WAND}" for side in ("left", "right")]
    assert main(["import", "aframe", str(CAPTURES / f"{name}.json"), "-o", str(session), *meshes]) == 0
    assert main(["run", str(session), "-o", str(out), "--no-picture", "--detectors", "hybrid,discrete"]) == 0
    assert "proxy" not in capsys.readouterr().out.lower()
    counts = json.loads((out / "summary.json").read_text())
    assert counts["session"]["frames"] == count
    for label in counts["detectors"]:
        rows = [row for row in pq.read_table(out / "episodes.parquet").to_pylist() if row["detector"] == label]
        assert [(row["first"], row["last"]) for row in rows] == truth, label
        assert all({row["body_a"], row["body_b"]} == {"left", "right"} for row in rows)
    frames = pq.read_table(out / "frames.parquet").to_pylist()
    assert [row["frame"] for row in frames] == [t for first, last in truth for t in range(first, last + 1)]
