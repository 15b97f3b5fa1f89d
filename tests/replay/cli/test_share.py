import json

import pytest
from support.small_worlds import cubes

import replay
from replay.cli.main import main
from replay.outputs.rerun_log import web_viewer


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setattr(web_viewer, "web_viewer", lambda: {web_viewer.SCRIPT: b"", web_viewer.PROGRAM: b""})
    session = cubes({"a": [0] * 8, "b": [3, 3, 0.9, 3, 3, 3, 0.9, 3]})
    return replay.run(session, detectors="slow=discrete[rate_hz=20]", oracle="hybrid", out=tmp_path / "run").out


def test_a_run_without_consent_is_shared_when_asked_for_anyway(run, tmp_path, capsys):
    assert main(["share", str(run), "-o", str(tmp_path / "sent")]) == 1
    said = capsys.readouterr().err
    assert "(consent: not stated)" in said and "add --anyway" in said and not (tmp_path / "sent").exists()
    assert main(["share", str(run), "-o", str(tmp_path / "sent"), "--anyway"]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert f"open {tmp_path / 'sent' / 'index.html'} in a browser" in said
    assert json.loads((tmp_path / "sent" / "share.json").read_text())["picture"] is True


def test_what_is_there_is_replaced_when_asked_and_only_if_it_is_a_shared_folder(run, tmp_path, capsys):
    target = tmp_path / "sent"
    words = ["share", str(run), "--anyway", "-o", str(target)]
    assert main(words) == 0 and main(words) == 1 and main([*words, "--force"]) == 0
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    assert main([*words[:-1], str(tmp_path / "mine"), "--force"]) == 1
    assert "is not a shared folder and is not replaced" in capsys.readouterr().err


def test_a_run_without_a_picture_is_shared_as_its_report(run, tmp_path, capsys):
    (run / "run.rrd").unlink()
    assert main(["share", str(run), "--anyway", "-o", str(tmp_path / "sent")]) == 0
    assert "the report alone, without a picture: no run holds a picture (run.rrd)" in capsys.readouterr().err
