"""A run folder may come from anybody: every verb that reads one answers a changed one, or refuses it in a sentence."""

import faulthandler
import os
import random
import re
import shutil
import sys

import pytest
from support.mutants import mutant
from support.processes import peak_bytes
from support.small_worlds import unit_cubes_on_x

import replay
from replay.cli.main import main
from replay.show.rerun_log import web_viewer
from sessions import write_session

POSITIONS = {"a": [0] * 24, "b": [*[3] * 6, 0.9, *[3] * 9, 0.9, *[3] * 7], "c": [9] * 24}
DETECTORS = "slow=discrete[rate_hz=20],late=discrete[rate_hz=12],hull=collider"
MOST_GROWTH_BYTES = 150 << 20
"""Memory that a changed folder may take beyond that of the first one."""
FOLDERS = int(os.environ.get("FOLDER_MUTANTS", "160")) // 8
"""Changed folders of each of the eight slow tests."""
HANGS_AFTER_SECONDS = 120
"""A verb that takes longer ends the process with the stack of every thread."""
FOREIGN_TEXTS = re.compile(r"should not have happened|magic|\barrow|thrift|codec|lz4|\bCRC|\bIPC|protobuf|brotli", re.I)
"""Words of a fault of ours, or of a library about its own format."""


class Window:
    """Stands in for the viewer's window."""

    def __init__(self, run, miss, **more):
        self.process = self

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def wait(self):
        pass


@pytest.fixture(scope="module")
def good_run_folder(tmp_path_factory):
    """A run folder of three cubes in 24 frames, two of which touch twice; every verb reads it without a problem."""
    at = tmp_path_factory.mktemp("good")
    write_session(unit_cubes_on_x(POSITIONS, facts={"consent": "share", "pseudonym": "S01"}), at / "s.mcap")
    return replay.run(at / "s.mcap", detectors=DETECTORS, out=at / "run").out


@pytest.fixture
def no_window(tmp_path, monkeypatch):
    """Viewers that would open are replaced; a module lies beside the folders that were sent."""
    (tmp_path / "sent_along.py").touch()  # some mutants name it as a detector
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(web_viewer, "web_viewer", lambda: {web_viewer.SCRIPT_FILE: b"", web_viewer.PROGRAM_FILE: b""})
    monkeypatch.setattr("replay.show.rerun_log.viewer.open_viewer", Window)


def faults_with_mutant(good, at, number, capsys):
    """Changes a copy of a good run folder as the seed ``number`` says, and has every verb read it.

    Returns a line for each verb that ends with another code than 0, 1 or 2, or prints a foreign text.
    """
    folder = at / "class" / "run"
    change = mutant(good, folder, number)
    session = ["--session", str(good.parent / "s.mcap")]
    kind, label = random.Random(number).choice([("--miss", "slow"), ("--false", "hull")])
    faults = []
    for arguments in (
        ["diff", good, folder],
        ["diff", folder, good, "--different-sessions"],
        ["shrink", folder, kind, "1", "--detector", label, "-o", at / "case", *session],
        ["share", folder, "-o", at / "sent", "--anyway"],
        ["view", folder, "--miss", "1"],
        ["study", "page", at / "class", "-o", at / "page"],
    ):
        faulthandler.dump_traceback_later(HANGS_AFTER_SECONDS, exit=True, file=sys.__stderr__)
        code = main([str(argument) for argument in arguments])
        faulthandler.cancel_dump_traceback_later()
        output = capsys.readouterr()
        if code not in (0, 1, 2) or FOREIGN_TEXTS.search(output.err):
            faults.append(f"{number} ({change}): {arguments[0]} {arguments[1]} ends with {code}: {output.err.strip()}")
    shutil.rmtree(at)
    at.mkdir()
    return faults


def assert_mutants_end_well(good, at, numbers, capsys):
    """Fails where a verb does not end in an answer or a sentence on the mutants of these seeds.

    Also fails where a mutant's code is imported, or where all but the first take more than MOST_GROWTH_BYTES.
    """
    at.mkdir()
    first, *others = numbers
    faults = faults_with_mutant(good, at, first, capsys)
    bytes_after_first = peak_bytes()
    for number in others:
        faults += faults_with_mutant(good, at, number, capsys)
    assert faults == []
    assert "sent_along" not in sys.modules
    assert peak_bytes() - bytes_after_first < MOST_GROWTH_BYTES


# 992: the column of detectors has another name, which the page of a class once added to a word.
@pytest.mark.slow
def test_changed_run_folder_ends_in_answer_or_sentence(good_run_folder, no_window, tmp_path, capsys):
    """Each number is a seed of changes to a run folder that somebody sent.

    Every verb that reads it answers or refuses it in a sentence, runs no code of it and takes little memory.
    """
    assert_mutants_end_well(good_run_folder, tmp_path / "at", [0, 1, 992, 1004, 1005], capsys)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(4, 2004, 250))
def test_changed_run_folders_of_all_kinds_end_in_an_answer(good_run_folder, no_window, tmp_path, capsys, first):
    """Seeds from ``first`` on, 20 unless more are requested (FOLDERS), each change a run folder that somebody sent.

    Every verb that reads it answers or refuses it in a sentence, runs no code of it and takes little memory. Eight
    tests start 250 seeds apart.
    """
    assert_mutants_end_well(good_run_folder, tmp_path / "at", range(first, first + FOLDERS), capsys)
