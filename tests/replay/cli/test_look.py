import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.planted_sessions import true_contact, write_scene

from cdcore import Verdict
from replay.advice import scene_outcome
from replay.cli import look
from replay.cli.main import main
from replay.engine import compute
from replay.show import scene_look
from sessions import read_session


@pytest.fixture(autouse=True, scope="module")
def two_depth_frames():
    """The depth of overlaps is measured in 2 contact frames, not in 24."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_outcome, "DEPTH_FRAMES", 2)
        yield


@pytest.fixture(scope="module")
def bytes_of_wrong_guess(tmp_path_factory):
    """A ROS recording whose GLB meshes are in the axes of their bodies, so that its import guesses wrong."""
    folder = tmp_path_factory.mktemp("ros")
    write_scene(folder, "ros", "glb")
    given = [f"--mesh={name}={folder / name}.glb" for name in ("tool", "plate")]
    mapping = ["--mapping", str(folder / "map.toml")]
    assert main(["import", "csv", str(folder / "take.csv"), *mapping, *given, "-o", str(folder / "s.mcap"), "-q"]) == 3
    return (folder / "s.mcap").read_bytes()


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch):
    """Pictures of 240 by 160 pixels, not of 960 by 640: most of the time of a look is drawing."""
    monkeypatch.setattr(scene_look, "PICTURE_SIZE", (240, 160))


@pytest.fixture
def no_pictures(monkeypatch):
    """Nothing is drawn, for the viewer neither: for tests of questions and answers."""
    monkeypatch.setattr(scene_look, "write_scene_pictures", lambda *_: [Path("first.png")])
    monkeypatch.setattr("replay.show.rerun_log.scene_look.write_scene_recording", lambda *_: None)


@pytest.fixture
def recording(bytes_of_wrong_guess, tmp_path):
    """A file of a recording of a tool and a plate; its import guessed that the axes of their meshes have y up.

    They are those of their bodies, which ROS has. Whether it is so is a question to the user, with answers 1a (as
    guessed), 1b (as the poses) and 1c (gltf).
    """
    (tmp_path / "s.mcap").write_bytes(bytes_of_wrong_guess)
    return tmp_path / "s.mcap"


def contact_by_frame(path):
    """Whether the only pair of a file's session is in contact, by frame."""
    verdict = compute(read_session(path), detectors="exact", oracle="none").detections["exact"].verdict
    return verdict[:, 0] == Verdict.CONTACT


def test_doctor_look_in_a_pipe_prints_question_and_pictures(recording, capsys):
    """The import guessed the axes of two meshes: the question is printed with answers a, b and c, and what each gives.

    The exit code 3 says that it is open. Pictures of three moments have more than 50 colours, so a scene is in them; a
    file for the viewer starts with its mark.
    """
    assert main(["doctor", str(recording), "--look"]) == 3
    output = capsys.readouterr()
    text, next_step = " ".join(output.out.split()), " ".join(output.err.split())
    assert "1 of 1 Axes of tool.glb and plate.glb; guessed" in text and "more plausible" not in text
    assert "b as the poses (ros): 2 contacts, at most 3 mm deep c gltf" in text
    assert f"replay doctor {recording} --answer 1a, 1b or 1c; or --mesh-axes when you import it" in next_step
    for name in ("first", "middle", "closest"):
        picture = np.asarray(Image.open(recording.with_name("s-look") / f"{name}.png"))
        assert picture.shape == (160, 240, 3) and len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
    assert (recording.with_name("s-look") / "look.rrd").read_bytes().startswith(b"RRF2")


@pytest.mark.slow
def test_the_more_plausible_alternative_is_marked_alone(recording, monkeypatch, capsys):
    """The import guessed the axes of two meshes; of the answers, b, the axes of the poses, is made more plausible."""
    monkeypatch.setattr("replay.advice.assumptions.more_plausible", lambda outcomes: "body")
    assert main(["doctor", str(recording), "--look"]) == 3
    text = " ".join(capsys.readouterr().out.split())
    assert "at most 3 mm deep more plausible c gltf" in text and text.count("more plausible") == 1


def test_piped_import_exits_3_until_its_guess_is_decided(tmp_path, capsys):
    """An import of a CSV has to guess the axes of GLB meshes, and says so, with exit code 3, also as JSON.

    Axes that ``--mesh-axes`` states decide it (0); with ``--no-look`` it is said, but the exit code is 0.
    """
    write_scene(tmp_path, "ros", "glb")
    given = [f"--mesh={name}={tmp_path / name}.glb" for name in ("tool", "plate")]
    given += ["--mapping", str(tmp_path / "map.toml"), "-o", str(tmp_path / "s.mcap"), "--force"]
    command = ["import", "csv", str(tmp_path / "take.csv"), *given]
    assert main(command) == 3
    output = " ".join(capsys.readouterr().err.split())
    assert "Not decided: axes of tool.glb and plate.glb. Taken for y-up; others: body, gltf." in output
    assert f"replay doctor {tmp_path / 's.mcap'} --look. To decide: --mesh-axes when you import it" in output
    assert main([*command, "--format", "json"]) == 3 and json.loads(capsys.readouterr().out)["bodies"]
    assert main([*command, "--mesh-axes", "body"]) == 0 and "Not decided" not in capsys.readouterr().err
    assert main([*command, "--no-look"]) == 0 and "not sure: axes of tool.glb" in capsys.readouterr().err


def test_an_answer_is_written_changes_the_contacts_and_is_forgotten(recording, capsys):
    """The import guessed the axes of two meshes wrong, so contacts are wrong; answer 1b gives those that were planted.

    No question is open then. Forgotten, the answer leaves meshes and picture as before it.
    """
    unanswered_bytes, unanswered = recording.read_bytes(), read_session(recording)
    picture = recording.with_name("s-look") / "closest.png"
    assert not np.array_equal(contact_by_frame(recording), true_contact())
    assert main(["doctor", str(recording), "--look"]) == 3
    unanswered_picture = picture.read_bytes()

    assert main(["doctor", str(recording), "--answer", "1b"]) == 0
    assert '--mesh-axes "body"' in capsys.readouterr().err
    assert recording.read_bytes() != unanswered_bytes
    assert picture.read_bytes() != unanswered_picture
    assert np.array_equal(contact_by_frame(recording), true_contact())
    assert main(["doctor", str(recording), "--look", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["questions"] == []

    assert main(["doctor", str(recording), "--forget-answers"]) == 0
    assert "1 answer forgotten" in capsys.readouterr().err
    assert picture.read_bytes() == unanswered_picture
    forgotten = read_session(recording)
    assert np.array_equal(forgotten.meshes["tool"].vertices, unanswered.meshes["tool"].vertices)


def test_nothing_is_written_where_no_answer_can_be_forgotten(recording):
    """The recording's only question was never answered."""
    before = recording.read_bytes()
    assert main(["doctor", str(recording), "--forget-answers"]) == 0
    assert recording.read_bytes() == before


@pytest.fixture
def mapping(recording, no_pictures, capsys):
    """A mapping that says how the recording's CSV is imported, with the answer 1b, axes of two meshes, as a line."""
    path = recording.with_name("map.toml")
    path.write_text('convention = "ros"\n')
    assert main(["doctor", str(recording), "--answer", "1b", "--mapping", str(path)]) == 0
    assert f"Written to {path}: mesh_axes" in " ".join(capsys.readouterr().err.split())
    line_of_answer = 'mesh_axes = ["tool=body", "plate=body"]  # answered; before: nothing\n'
    assert path.read_text() == 'convention = "ros"\n' + line_of_answer
    return path


def test_forgotten_answers_leave_recording_and_mapping(recording, mapping, capsys):
    """Answer 1b added a line to the mapping, whose path is then a fact of the recording; forgetting removes both."""
    assert "answered_mapping" in read_session(recording).facts
    assert main(["doctor", str(recording), "--forget-answers"]) == 0
    assert mapping.read_text() == 'convention = "ros"\n'
    assert f"{mapping}: 1 line as before the answers" in " ".join(capsys.readouterr().err.split())
    assert "answered_mapping" not in read_session(recording).facts


def test_answer_in_a_moved_mapping_is_forgotten_by_its_path(recording, mapping, capsys):
    """The mapping was renamed after the answer: the command says that it is not there.

    With ``--mapping`` the line of the answer goes from the file where it is now.
    """
    moved = mapping.rename(mapping.with_name("moved.toml"))
    assert main(["doctor", str(recording), "--forget-answers"]) == 0
    assert "is not there; where it is now: --mapping FILE" in " ".join(capsys.readouterr().err.split())
    assert main(["doctor", str(recording), "--forget-answers", "--mapping", str(moved)]) == 0
    assert moved.read_text() == 'convention = "ros"\n'


@pytest.mark.parametrize(
    ("replies", "axes", "code", "is_helped"),
    [(("?", "x", "b"), "body", 0, True), (("",), "y-up", 3, False)],
    ids=["answered", "left open"],
)
def test_terminal_repeats_the_question_until_answered_or_left_open(
    recording, no_pictures, monkeypatch, replies, axes, code, is_helped, capsys
):
    """The question is which axes two meshes have. Neither "?" nor "x" is a letter of the list, as the terminal says.

    "b" is that of the axes ``body``, which the recording then has (exit code 0); no reply leaves the guess (3).
    ``is_helped``: whether the terminal explains which replies there are.
    """
    unread_replies = [*replies]
    monkeypatch.setattr(look.click, "prompt", lambda *_, **__: unread_replies.pop(0))
    assert look.look_at(recording, look.People(), as_json=False, given={}, asks=True) == code
    assert unread_replies == []
    assumptions = json.loads(read_session(recording).facts["assumptions"])
    assert [row["value"] for row in assumptions if row["subject"] == "axes of meshes"] == [axes]
    assert ("letter of the line" in capsys.readouterr().out) == is_helped


def test_doctor_refuses_answers_that_fit_no_question(recording, capsys):
    """The recording has one question, with answers a to c. Refused are question 2, answer d, and an answer alone.

    Each is a wrong call (exit code 2), and nothing is written, no picture either.
    """
    refusals = {
        "2a": "there is 1 question",
        "1d": "question 1 has the answers a, b, c",
        "b": "not a question and a letter",
    }
    before = recording.read_bytes()
    for answer, message in refusals.items():
        assert main(["doctor", str(recording), "--answer", answer]) == 2, answer
        assert re.search(message, " ".join(capsys.readouterr().err.split())), answer
    assert recording.read_bytes() == before
    assert [*recording.parent.iterdir()] == [recording]


@pytest.mark.slow
def test_batch_study_and_tradeoff_name_recordings_with_open_guesses(recording, tmp_path, capsys):
    """Two recordings whose import guessed axes, of which one has its answer; the other is named as not decided.

    By a run of both, on the page of a study of the other and on its screen, and in a tradeoff of the other.
    """
    answered = tmp_path / "answered.mcap"
    answered.write_bytes(recording.read_bytes())
    assert main(["doctor", str(answered), "--answer", "1b"]) == 0
    runs = ["--detectors", "exact", "--out", str(tmp_path / "runs")]
    line = "Not decided: in 1 of 2 sessions a guess of the import changes the contacts"
    assert main(["run", str(recording), str(answered), *runs]) == 0
    assert f"{line} (s). To decide" in " ".join(capsys.readouterr().out.split())
    assert main(["study", "page", str(tmp_path / "runs" / "s"), "--out", str(tmp_path / "page")]) == 0
    assert line.replace("2 sessions", "1 session") in " ".join(capsys.readouterr().out.split())
    assert line.replace("2 sessions", "1 session") in (tmp_path / "page" / "study.html").read_text()
    assert main(["tradeoff", str(recording), "--detectors", "exact", "--format", "json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["open_questions"]) == 1


@pytest.mark.slow
def test_engine_advice_names_the_command_for_open_questions(recording, capsys):
    """Advice which colliders to use in Unity, on a recording whose import guessed the axes of meshes."""
    main(["tradeoff", str(recording), "--engine", "unity"])
    assert f"To decide: replay doctor {recording} --look" in " ".join(capsys.readouterr().out.split())


def test_look_command_takes_a_single_session_file(tmp_path, recording, capsys):
    """`replay doctor --look` draws the scene of one recording; here it is named twice, which is a wrong call (2)."""
    assert main(["doctor", str(recording), str(recording), "--look"]) == 2
    assert "are for one session file" in capsys.readouterr().err
