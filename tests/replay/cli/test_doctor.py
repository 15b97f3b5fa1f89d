import json

import pytest
from support.planted_faults import FAULTS, clean

from replay.cli.main import main


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("doctor")
    rounded, broken = clean(), clean()
    rounded.arrays["quaternion_xyzw"][:, 0] *= 1 + 1e-5
    FAULTS["frozen pose"](broken, 1, 300)
    return rounded.write(folder / "clean.mcap"), broken.write(folder / "frozen.mcap")


def test_a_clean_session_can_be_trusted_and_its_notes_are_one_line(files, capsys):
    assert main(["doctor", str(files[0])]) == 0
    text = capsys.readouterr().out
    assert "clean.mcap  nothing suspicious found" in text and "notes (-v lists them): off-unit-quaternion\n" in text
    assert main(["doctor", str(files[0]), "-v"]) == 0
    assert "the rotation was rounded" in " ".join(capsys.readouterr().out.split())


def test_a_fault_is_said_with_body_span_meaning_and_cure(files, capsys):
    assert main(["doctor", str(files[1])]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "frozen.mcap 2 warnings" in text
    assert "frozen warning hand-left 3.333 to 3.989" in text and "nothing was measured" in text and "--policy" in text


def test_json_holds_every_finding_of_every_file(files, capsys):
    assert main(["doctor", *map(str, files), "--format", "json"]) == 0
    clean_one, broken = json.loads(capsys.readouterr().out)
    assert [one["code"] for one in clean_one["findings"]] == ["off-unit-quaternion"]
    assert next((one["code"], one["body"]) for one in broken["findings"]) == ("frozen", "hand-left")
    assert broken["file"] == str(files[1])


@pytest.mark.parametrize(("gate", "codes"), [("error", (0, 0)), ("warning", (0, 4)), ("note", (4, 4))])
def test_the_gate_fails_on_what_it_was_asked_to(files, gate, codes, capsys):
    assert tuple(main(["doctor", str(file), "--fail-on", gate]) for file in files) == codes
    said = capsys.readouterr().err
    assert ("or worse" in said) == (4 in codes)
