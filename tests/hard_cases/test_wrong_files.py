"""Session files that are wrong: no crash, no contradiction between commands, and a cost in proportion to their bytes.

Four commands read a file: ``doctor`` examines it, ``info`` says what it holds, ``run`` replays it, and ``recover``
copies what can be read. ``verbs`` gives for each whether it accepts a file, and what it says.
"""

import json
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.processes import environment
from support.wrong_files import BOMBS, WRONG, chunk, contradictions, good_files, message, plus, verbs, wrong_bytes

from sessions import read_session
from sessions.errors import SessionError


@pytest.fixture(scope="module")
def good_files_by_kind(tmp_path_factory):
    """A file of each kind that is read without a problem."""
    return good_files(tmp_path_factory.mktemp("good"))


@pytest.fixture(scope="module")
def folder_of_damaged_files(tmp_path_factory):
    """A folder for one damaged file after the other."""
    return tmp_path_factory.mktemp("damaged")


def test_good_session_file_is_accepted_by_four_commands(good_files_by_kind, tmp_path):
    """A file of our own profile; ``recover`` copies it, and that copy is accepted too."""
    (tmp_path / "s.mcap").write_bytes(good_files_by_kind["own"])
    answers = verbs(tmp_path / "s.mcap", tmp_path / "out.mcap")
    assert set(answers) >= {"doctor", "info", "run", "recover"}
    assert all(accepted for accepted, _sentence in answers.values()), answers


@pytest.mark.sampled(14)
@pytest.mark.parametrize("case", WRONG)
def test_four_commands_agree_about_a_wrong_file(good_files_by_kind, tmp_path, case):
    """``doctor``, ``info``, ``run`` and ``recover`` read a good file with a change of ``WRONG``, which spoils it.

    A contradiction is, for example, a file that ``run`` reads and ``info`` refuses.
    """
    good = good_files_by_kind["own"]
    wrong = WRONG[case](good)
    assert wrong != good
    assert contradictions(wrong, tmp_path) == []


@settings(max_examples=max(4, settings.default.max_examples // 3))
@given(data=st.data())
def test_four_commands_do_not_contradict_each_other_on_damaged_files(good_files_by_kind, folder_of_damaged_files, data):
    """Good files whose bytes and records are changed at random."""
    damaged = data.draw(wrong_bytes(good_files_by_kind))
    assert contradictions(damaged, folder_of_damaged_files) == []


def test_number_of_messages_is_bounded_by_file_size(good_files_by_kind, tmp_path):
    """110,000 equal messages pack into 33 kB; 100,000 are allowed, and one more for every 4 bytes: 108,000 and some."""
    bomb = tmp_path / "bomb.mcap"
    bomb.write_bytes(plus(chunk([message(5)] * 110_000))(good_files_by_kind["own"]))
    assert bomb.stat().st_size < 34_000
    with pytest.raises(SessionError, match=r"bytes hold more than 108,\d\d\d messages"):
        read_session(bomb)


COST_PROGRAM = """
import json, sys, time
from pathlib import Path
from support.processes import peak_bytes
from replay.prepare.session_info import session_info
from sessions import examine, read_session, recover
from sessions.errors import SessionError
bomb, verb, good_file = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
work = {"info": lambda p: session_info(read_session(p)), "doctor": examine,
        "recover": lambda p: recover(p, p.with_suffix(".out"), overwrite=True)}[verb]
work(good_file)
bytes_before, start = peak_bytes(), time.process_time()
try:
    work(bomb)
except SessionError as error:
    pass
print(json.dumps([time.process_time() - start, peak_bytes() - bytes_before]))
"""
"""Prints the processor seconds and the bytes of memory that a file takes a command beyond those of a good file."""


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
@pytest.mark.parametrize("command", ["info", "doctor", "recover"])
def test_small_file_costs_at_most_100_mb_and_2_s(good_files_by_kind, tmp_path, name, command):
    """``BOMBS``: records that unpack to much, or take long, added to a good file; the cost is that beyond the good
    file.

    1 s and 50 MB are allowed more for each MB of the file.
    """
    bomb, good_file = tmp_path / "bomb.mcap", tmp_path / "good.mcap"
    good_file.write_bytes(good_files_by_kind["own"])
    bomb.write_bytes(plus(*BOMBS[name]())(good_files_by_kind["own"]))
    program = [sys.executable, "-c", COST_PROGRAM, str(bomb), command, str(good_file)]
    process = subprocess.run(program, env=environment(), capture_output=True, text=True, timeout=120, check=True)
    seconds, memory_bytes = json.loads(process.stdout)
    size_bytes = bomb.stat().st_size
    assert seconds <= 2 + size_bytes / 1e6
    assert memory_bytes <= 100 * 2**20 + 50 * size_bytes
