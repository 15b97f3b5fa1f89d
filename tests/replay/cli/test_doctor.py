import json

import pytest
from support.damage import chunks, flipped
from support.mcap_samples import random_frames, session_of
from support.planted_faults import FAULTS, clean
from support.small_worlds import cubes

from replay.cli.main import main
from sessions import Event, Interval, Scene, read_session, write_session
from sessions.model.scene import SceneBody


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("doctor")
    broken = clean()
    FAULTS["frozen pose"](broken, 1, 300)
    return clean().write(folder / "clean.mcap"), broken.write(folder / "frozen.mcap")


def test_a_clean_session_can_be_trusted_and_its_notes_are_one_line(files, capsys):
    assert main(["doctor", str(files[0])]) == 0
    text = capsys.readouterr().out
    assert "clean.mcap  can be trusted" in text and "notes (-v lists them): at-rest" in text


def test_a_fault_is_said_with_body_span_meaning_and_cure(files, capsys):
    assert main(["doctor", str(files[1])]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "frozen.mcap 2 warnings" in text
    assert "frozen hand-left 3.333 to 3.989" in text and "nothing was measured" in text and "--policy" in text


def test_verbose_lists_the_notes(files, capsys):
    assert main(["doctor", str(files[0]), "-v"]) == 0
    assert "at rest, and without tracker noise" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("how", [["--json"], ["--format", "json"]])
def test_json_holds_every_finding_of_every_file(files, how, capsys):
    assert main(["doctor", *map(str, files), *how]) == 0
    clean_one, broken = json.loads(capsys.readouterr().out)
    assert [one["code"] for one in clean_one["findings"]] == ["at-rest"]
    assert next((one["code"], one["body"]) for one in broken["findings"]) == ("frozen", "hand-left")
    assert broken["file"] == str(files[1])


@pytest.mark.parametrize(("gate", "codes"), [("error", (0, 0)), ("warning", (0, 4)), ("note", (4, 4))])
def test_the_gate_fails_on_what_it_was_asked_to(files, gate, codes, capsys):
    assert tuple(main(["doctor", str(file), "--fail-on", gate]) for file in files) == codes
    said = capsys.readouterr().err
    assert ("or worse" in said) == (4 in codes)


def test_a_missing_file_is_a_matter_of_usage(tmp_path, capsys):
    assert main(["doctor", str(tmp_path / "none.mcap")]) == 2
    assert "none.mcap" in capsys.readouterr().err


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    scene = Scene(name="two-cubes", bodies=(SceneBody("a", proxy=True),))
    session = cubes(
        {"a": range(200), "b": [9] * 200},
        scene=scene,
        events=[Event(5, "press"), Event(9, "press")],
        intervals=[Interval(20_000_000, 90_000_000, "task", "stir")],
        facts={"vr_type": "immersive", "synthetic": "cubes"},
    )
    path = tmp_path_factory.mktemp("session") / "s.mcap"
    write_session(session, path)
    return path


def test_text_names_bodies_clock_tasks_and_events(file, capsys):
    assert main(["info", str(file)]) == 0
    text = capsys.readouterr().out
    assert "2.0 s, 200 frames at 100.0 Hz, 0 gaps" in text
    assert "events: press 2" in text and "task  stir" in text and "vr_type: immersive" in text
    row = next(line for line in text.splitlines() if line.strip().startswith("b ")).split()
    assert row[:5] == ["b", "12", "200", "100.0", "Hz"]
    assert "synthetic" not in text


def test_verbose_shows_all_facts(file, capsys):
    assert main(["info", str(file), "-v"]) == 0
    assert "synthetic: cubes" in capsys.readouterr().out


def test_json_holds_the_same(file, capsys):
    assert main(["info", str(file), "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["frames"]["count"] == 200 and [body["name"] for body in told["bodies"]] == ["a", "b"]


@pytest.mark.parametrize(("seconds", "words"), [(59.96, "60.0 s"), (605, "10 min 5 s"), (28_800, "8 h 0 min")])
def test_lengths_are_in_the_unit_people_use(seconds, words):
    from replay.cli.info import _clock_time

    assert _clock_time(seconds) == words


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
    told = json.loads(capsys.readouterr().out)
    assert told["frames"] > 0 and told["source"] == str(whole)


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
