"""Session files that are wrong: no crash, no contradiction between verbs, and a cost in proportion to their bytes."""

import json
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.processes import environment
from support.wrong_files import BOMBS, WRONG, chunk, contradictions, good_files, message, plus, verbs, wrong_bytes


@pytest.fixture(scope="module")
def good_files_by_kind(tmp_path_factory):
    """A file of each kind that is read without a problem."""
    return good_files(tmp_path_factory.mktemp("good"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("place")


def test_good_session_file_is_accepted_by_four_commands(good_files_by_kind, tmp_path):
    """By doctor, info, run and recover, whose copy is accepted too."""
    (tmp_path / "s.mcap").write_bytes(good_files_by_kind["own"])
    answers = verbs(tmp_path / "s.mcap", tmp_path / "out.mcap")
    assert all(accepted for accepted, _ in answers.values()), answers


@pytest.mark.sampled(8)
@pytest.mark.parametrize("case", WRONG)
def test_four_verbs_agree_about_a_wrong_file(good_files_by_kind, tmp_path, case):
    """By doctor, info, run and recover; a contradiction is, for example, a file that run reads and info refuses."""
    data = WRONG[case](good_files_by_kind["own"])
    assert data != good_files_by_kind["own"] and contradictions(data, tmp_path) == []


@settings(max_examples=max(4, settings.default.max_examples // 3))
@given(data=st.data())
def test_four_commands_do_not_contradict_each_other_on_damaged_files(good_files_by_kind, folder, data):
    """By doctor, info, run and recover, on random changes of good files."""
    assert contradictions(data.draw(wrong_bytes(good_files_by_kind)), folder) == []


def test_unpacked_size_is_bounded_by_the_size_of_the_file(good_files_by_kind, tmp_path):
    """150,000 equal messages pack into a file that is far smaller than they are: it is refused."""
    path = tmp_path / "bomb.mcap"
    path.write_bytes(plus(chunk([message(5)] * 150_000))(good_files_by_kind["own"]))
    assert not verbs(path, tmp_path / "out.mcap")["info"][0]


PROGRAM = """
import json, sys, time
from pathlib import Path
from support.processes import peak_bytes
from replay.prepare.session_info import session_info
from sessions import examine, read_session, recover
from sessions.errors import SessionError
path, verb = Path(sys.argv[1]), sys.argv[2]
work = {"info": lambda p: session_info(read_session(p)), "doctor": examine,
        "recover": lambda p: recover(p, p.with_suffix(".out"), overwrite=True)}[verb]
work(Path(sys.argv[3]))
plain, began = peak_bytes(), time.process_time()
try:
    work(path)
except SessionError as error:
    pass
print(json.dumps([time.process_time() - began, peak_bytes() - plain]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
@pytest.mark.parametrize("verb", ["info", "doctor", "recover"])
def test_small_file_costs_at_most_100_mb_and_2_s(good_files_by_kind, tmp_path, name, verb):
    """The cost is that beyond a good file; 1 s and 50 MB are added for each MB of the file."""
    path, plain = tmp_path / "bomb.mcap", tmp_path / "good.mcap"
    plain.write_bytes(good_files_by_kind["own"])
    path.write_bytes(plus(*BOMBS[name]())(good_files_by_kind["own"]))
    command, size = [sys.executable, "-c", PROGRAM, str(path), verb, str(plain)], path.stat().st_size
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=120, check=True)
    seconds, spent = json.loads(done.stdout)
    assert seconds <= 2 + size / 1e6 and spent <= (100 << 20) + 50 * size
