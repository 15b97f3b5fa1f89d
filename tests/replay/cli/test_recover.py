import json

import pytest
from support.damage import chunks, flipped
from support.mcap_samples import random_frames, session_of

from replay.cli.main import main
from sessions import read_session, write_session


@pytest.fixture
def whole(tmp_path):
    write_session(session_of(random_frames(1, 900, 3)), tmp_path / "s.mcap")
    return tmp_path / "s.mcap"


def test_a_damaged_file_is_saved_with_exit_code_three_and_what_was_lost_is_said(whole, tmp_path, capsys):
    data = whole.read_bytes()
    start, end = chunks(data)[1]
    whole.write_bytes(flipped(data, start + 60, end, 9, 0))
    out = tmp_path / "out.mcap"
    assert main(["recover", str(whole), str(out)]) == 3
    printed, said = capsys.readouterr()
    assert "kept" in printed and "messages, " in printed and "is damaged" in printed
    assert f"replay doctor {out}" in said
    assert sum(len(block) for block in read_session(out).blocks(4096)) > 500


def test_a_torn_file_is_saved(whole, tmp_path, capsys):
    whole.write_bytes(whole.read_bytes()[:-2000])
    assert main(["recover", str(whole), str(tmp_path / "out.mcap"), "--format", "json"]) in (0, 3)
    report = json.loads(capsys.readouterr().out)
    assert report["frames"] > 0 and report["source"] == str(whole)


def test_a_whole_file_exits_with_zero(whole, tmp_path, capsys):
    assert main(["recover", str(whole), str(tmp_path / "out.mcap")]) == 0
    assert "nothing was lost" in capsys.readouterr().out


def test_what_cannot_be_saved_is_one_sentence(tmp_path, capsys):
    (tmp_path / "x.mcap").write_bytes(b"hello")
    assert main(["recover", str(tmp_path / "x.mcap"), str(tmp_path / "out.mcap")]) == 1
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(error) == 1 and "not an MCAP file" in error[0]
    assert not (tmp_path / "out.mcap").exists()


def test_a_file_that_is_there_is_replaced_only_when_asked(whole, tmp_path, capsys):
    (tmp_path / "out.mcap").write_bytes(b"mine")
    assert main(["recover", str(whole), str(tmp_path / "out.mcap")]) == 1
    assert "there already" in capsys.readouterr().err
    assert main(["recover", str(whole), str(tmp_path / "out.mcap"), "--force"]) == 0


def test_after_a_kill_what_may_be_missing_is_said_and_the_exit_code_is_three(whole, tmp_path, capsys):
    data = whole.read_bytes()
    whole.write_bytes(data[: chunks(data)[-1][1]])
    assert main(["recover", str(whole), str(tmp_path / "out.mcap")]) == 3
    printed = capsys.readouterr().out
    assert "it was never closed" in printed and "may be missing" in printed and "nothing was lost" not in printed
