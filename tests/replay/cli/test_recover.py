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


def test_a_file_that_is_there_is_replaced_only_when_asked(whole, tmp_path, capsys):
    (tmp_path / "out.mcap").write_bytes(b"mine")
    assert main(["recover", str(whole), str(tmp_path / "out.mcap")]) == 1
    assert "--force" in capsys.readouterr().err
    assert main(["recover", str(whole), str(tmp_path / "out.mcap"), "--force"]) == 0
    assert "nothing was lost" in capsys.readouterr().out
