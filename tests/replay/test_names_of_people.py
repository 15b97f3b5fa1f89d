"""A session file and its participants may be named after people; no page, table or picture of a run names them."""

import base64
import gzip
import re

import pyarrow.parquet as pq
import pytest
from rerun.chunk import RrdReader
from support.small_worlds import cube

import replay
from replay.cli.main import main
from replay.outputs.rerun_log import web_viewer
from sessions import Recorder

NAMES = ("anna_mueller", "matr4711", "berta schulz")
WHERE = [*[3] * 6, 0.9, *[3] * 9, 0.9, *[3] * 7]


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    file = tmp_path_factory.mktemp("lab") / "anna_mueller_matr4711.mcap"
    with Recorder(
        file, meshes={"a": cube(), "hand-left": cube()}, facts={"consent": "share", "pseudonym": "S07"}
    ) as recorder:
        for frame, place in enumerate(WHERE):
            stamp = frame * 10_000_000
            recorder.poses(stamp, {"a": ((0, 0, 0), (0, 0, 0, 1)), "hand-left": ((place, 0, 0), (0, 0, 0, 1))})
            recorder.hand(stamp, "anna_mueller", "left", trigger=float(5 < frame < 9))
            recorder.gaze(stamp, "anna_mueller", (0, 5, 0), (0, -1, 0))
            recorder.gaze(stamp, "berta schulz", (0, 5, 0), (0, -1, 0))
    return file


def texts(folder):
    """All that can be read in a folder: tables, pages, scripts unpacked, pictures taken apart."""
    for file in sorted(folder.iterdir()):
        yield file.name, file.name + file.read_bytes().decode("latin-1")
        for packed in re.findall(rb'packed="([^"]*)"', file.read_bytes() if file.suffix == ".js" else b""):
            yield file.name, gzip.decompress(base64.b64decode(packed)).decode("latin-1")
        if file.suffix == ".parquet":
            yield file.name, repr(pq.read_table(file).to_pylist())
        if file.suffix == ".rrd":
            batches = (chunk.to_record_batch() for chunk in RrdReader(file).stream().to_chunks())
            yield file.name, repr([(one.schema, one.to_pylist() if one.num_rows < 50 else "") for one in batches])


def test_no_file_of_a_run_or_of_a_shared_folder_names_a_person(recording, tmp_path, monkeypatch):
    monkeypatch.setattr(web_viewer, "web_viewer", lambda: {web_viewer.SCRIPT: b"", web_viewer.PROGRAM: b""})
    run = replay.run(recording, detectors="slow=discrete[rate_hz=20]", oracle="hybrid", out=tmp_path / "run").out
    assert main(["share", str(run), "-o", str(tmp_path / "sent")]) == 0
    for folder in (run, tmp_path / "sent"):
        told = [(file, name) for file, text in texts(folder) for name in NAMES if name in text.lower()]
        assert told == []
    page = (tmp_path / "sent" / "index.html").read_text(encoding="utf-8")
    assert "S07" in page and replay.read(run)["metrics"]["session"][0].as_py() in page


def test_the_recording_of_a_run_is_found_by_its_content(recording, tmp_path):
    renamed = recording.rename(recording.with_name("s1.mcap"))
    replay.run(renamed, detectors="slow=discrete[rate_hz=20]", oracle="hybrid", out=tmp_path / "run", picture=False)
    renamed.rename(tmp_path / "another_name.mcap")
    (tmp_path / "s1.mcap").write_bytes(b"of another lesson")
    assert main(["shrink", str(tmp_path / "run"), "--miss", "1", "-o", str(tmp_path / "case")]) == 0
