"""The way to a miss can be read from the file alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from replay.errors import RunFolderError
from replay.rerun_log.focus import moments
from replay.rerun_log.miss_table import read_misses
from replay.rerun_log.recording import write_recording
from replay.run_result import RunResult


def test_misses_read_back_with_the_nanosecond_of_their_deepest_frame(demo: RunResult, recording: Path) -> None:
    stamps, misses = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0], demo.misses["22.5Hz"]
    at = moments(misses)
    assert [(one.number, one.session_ns, one.cut_length) for one in read_misses(recording)] == [
        (miss.number, int(stamps[at[miss.number][0]]) + at[miss.number][1], miss.cut_length) for miss in misses
    ]


def test_a_recording_without_misses_has_none(demo: RunResult, tmp_path: Path) -> None:
    write_recording(replace(demo, misses={"22.5Hz": ()}), tmp_path / "none.rrd")
    assert read_misses(tmp_path / "none.rrd") == []


@pytest.mark.parametrize("content", [b"", b"not a recording"])
def test_a_file_that_is_no_recording_is_one_sentence(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run.rrd").write_bytes(content)
    with pytest.raises(RunFolderError, match=r"run\.rrd cannot be read as a recording"):
        read_misses(tmp_path / "run.rrd")
