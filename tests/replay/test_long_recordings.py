"""Recordings on both sides of the limit up to which poses are held in memory: every verb and detector, one answer."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.rows import ROWS
from support.small_worlds import along_x, cube

from replay.base.constants import HELD_FRAMES
from replay.cli.main import main
from replay.comparison.first_touch import poses_between
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import run_detector
from replay.pipeline.engine import compute
from replay.prepare import assemble_stored
from replay.prepare.assemble import assemble
from replay.prepare.assemble_stored import StoredMotion
from sessions import Session, write_session

FRAMES = 2_000
STEP_NS = 11_111_111
FAST = "sphere,aabb,hybrid,slow=discrete[rate_hz=7.5]"


def two_cubes(frames):
    """A cube of 2 cm that swings through another at up to 1.9 m/s, once in two seconds; 12 faces each."""
    time = np.arange(frames) * (STEP_NS / 1e9)
    poses = {"a": along_x(np.zeros(frames)), "b": along_x(0.6 * np.sin(np.pi * (time + 0.31)))}
    return Session.from_arrays(np.arange(frames) * STEP_NS, poses, {"a": cube(0.02), "b": cube(0.02)})


def answers(result):
    digests = {label: found.digest for label, found in result.detections.items()}
    return digests, result.misses, result.causes, result.episodes, result.dwell, result.summary["dwell"]


QUICK = ("exact", "discrete")
OTHERS = (*(name for name in ROWS if name not in QUICK), "continuous as oracle")
SLOW = [
    pytest.param(*name.values, marks=[*name.marks, pytest.mark.slow])
    if hasattr(name, "values")
    else pytest.param(name, marks=pytest.mark.slow)
    for name in OTHERS
]


@pytest.mark.parametrize("name", [*QUICK, *SLOW])
def test_a_detector_answers_alike_on_both_sides_of_the_limit(name, monkeypatch):
    frames = 100 if name == "image-space" else FRAMES  # it draws every frame
    asked = {"oracle": "continuous"} if name.startswith("continuous") else {"detectors": name, "oracle": "exact"}
    asked.setdefault("detectors", "hybrid,slow=discrete[rate_hz=7.5]")
    found = []
    for limit in (frames + 1, frames, frames - 1):
        monkeypatch.setattr(assemble_stored, "HELD_FRAMES", limit)
        result = compute(two_cubes(frames), **asked)
        assert isinstance(result.assembly.motion, StoredMotion) is (limit < frames)
        found.append(answers(result))
    assert repr(found[0]) == repr(found[1]) == repr(found[2]) and any(found[0][3].values())


def test_a_short_motion_on_disk_is_handed_to_a_detector_as_arrays():
    held = assemble(two_cubes(300))
    stored = replace(held, motion=StoredMotion(held.motion.blocks(70)))
    runs = [
        run_detector(parse_detector("hybrid-qaco"), one, seed=0, faces=True, advance=lambda _: None)
        for one in (held, stored)
    ]
    assert runs[0].detection.digest == runs[1].detection.digest


def test_poses_between_frames_are_alike_of_a_motion_on_disk():
    motion = assemble(two_cubes(300)).motion
    moments = np.array([2.5, 0.013, 2.501, 0.02])
    held, stored = (poses_between(one, np.array([1, 0]), moments) for one in (motion, StoredMotion(motion.blocks(70))))
    assert np.array_equal(held.translations, stored.translations)
    assert np.array_equal(held.rotations, stored.rotations)


def test_a_short_window_of_a_long_recording_is_held_in_memory(monkeypatch):
    monkeypatch.setattr(assemble_stored, "HELD_FRAMES", FRAMES - 1)
    result = compute(two_cubes(FRAMES), detectors="hybrid-qaco", oracle="exact", start=1, end=10)
    assert not isinstance(result.assembly.motion, StoredMotion)
    assert len(result.assembly.motion) == 810


def every_verb(folder, *, frames, tried):
    """All verbs that read a recording, over one of so many frames; the summary of its run."""
    file, run, runs = folder / "long.mcap", folder / "run", folder / "runs"
    write_session(two_cubes(frames), file)
    asked = ["--detectors", FAST, "--oracle", "continuous", "--quiet"]
    window = ["--start", "1", "--end", "10"]
    lines = [
        ["info", file], ["doctor", file], ["scene", "check", file], ["recover", file, folder / "again.mcap"],
        ["run", file, "--out", run, *asked], ["run", file, "--out", folder / "short", *window, *asked],
        ["run", file, "--out", runs / "one", *asked],
        ["run", file, "--out", runs / "two", "--no-picture", *window, *asked],
        ["tradeoff", file, "--out", folder / "costs", "--oracle", "hybrid", *tried, "--repeats", "1", "--quiet"],
        ["diff", run, runs / "one"],
    ]  # fmt: skip
    for line in lines:
        assert main([str(word) for word in line]) == 0, line
    summary = json.loads((Path(run) / "summary.json").read_text())
    assert summary["session"]["frames"] == frames and (run / "run.rrd").stat().st_size > 100_000
    return summary["audit"]


@pytest.mark.slow
@pytest.mark.parametrize("limit", [FRAMES, FRAMES - 1])
def test_every_verb_reads_a_recording_at_its_limit(limit, tmp_path, monkeypatch):
    monkeypatch.setattr(assemble_stored, "HELD_FRAMES", limit)
    assert every_verb(tmp_path, frames=FRAMES, tried=["--time-limit", "0.01"])["slow"]["contacts"] == 22


@pytest.mark.slow
def test_every_verb_reads_a_recording_of_more_than_an_hour(tmp_path):
    audit = every_verb(tmp_path, frames=HELD_FRAMES + 1, tried=["--time-limit", "0.01"])
    assert audit["slow"]["contacts"] == 3_600
