"""The public A-Frame recordings, imported and run from the command line, touch in exactly the frames stated."""

import json

import pyarrow.parquet as pq
import pytest
from support.shared_data import DATA, needs_data

from replay.cli.main import main

WAND = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
CAPTURES = DATA / "aframe-motion-capture"

TRUTH = {"grabLeft": [(195, 278)], "grabRight": [], "tracked-recording": [(140, 155), (2124, 2567)]}
"""Recording -> first and last frame of each contact of the two wands. Source: README.md beside the recordings."""

pytestmark = [needs_data, pytest.mark.slow]


@pytest.mark.parametrize("name", TRUTH)
def test_an_imported_recording_gives_exactly_the_contact_frames_stated(name, tmp_path, capsys):
    session, out = tmp_path / "s.mcap", tmp_path / "run"
    meshes = [f"--mesh={side}={WAND}" for side in ("left", "right")]
    assert main(["import", "aframe", str(CAPTURES / f"{name}.json"), "-o", str(session), *meshes]) == 0
    assert main(["run", str(session), "-o", str(out), "--no-picture", "--detectors", "hybrid,discrete"]) == 0
    printed = capsys.readouterr().out
    assert "proxy" not in printed.lower()
    told = json.loads((out / "summary.json").read_text())
    for label in told["detectors"]:
        rows = [row for row in pq.read_table(out / "episodes.parquet").to_pylist() if row["detector"] == label]
        assert [(row["first"], row["last"]) for row in rows] == TRUTH[name], label
        assert all({row["body_a"], row["body_b"]} == {"left", "right"} for row in rows)
    frames = pq.read_table(out / "frames.parquet").to_pylist()
    assert [row["frame"] for row in frames] == [t for first, last in TRUTH[name] for t in range(first, last + 1)]
