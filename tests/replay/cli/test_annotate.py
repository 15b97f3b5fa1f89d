"""What is said of a contact stays with it: across runs, numbers, copies of the recording; and nothing else changes."""

import json

import pytest
from rerun.chunk import RrdReader
from support.small_worlds import cubes

import replay
from replay.cli.main import main
from replay.outputs.rerun_log.recording_file import write_layer
from replay.outputs.results.annotations import TAGS, read_annotations
from replay.outputs.results.run_folder import read_run_folder
from sessions import read_session, write_session

# contacts at frames 2, 6-8 and 12; at 100 Hz a look at every fourth frame sees the second only
PLACES = {"a": [0] * 16, "b": [3, 3, 0.9, 3, 3, 3, 0.9, 0.9, 0.9, 3, 3, 3, 3, 0.9, 3, 3]}
HOSTILE = "<script>alert(1)</script> \x1b[31m \u202e wall"


@pytest.fixture
def folder(tmp_path):
    write_session(cubes(PLACES), tmp_path / "s.mcap")
    return tmp_path


@pytest.fixture(scope="module")
def ready(tmp_path_factory):
    """A folder with a run in it, for tests that leave nothing there."""
    folder = tmp_path_factory.mktemp("ready")
    write_session(cubes(PLACES), folder / "s.mcap")
    run(folder)
    return folder


def run(folder, detectors="slow=discrete[rate_hz=25]"):
    return replay.run(folder / "s.mcap", detectors=detectors, oracle="hybrid", out=folder / "run", force=True)


def said_of(folder, capsys):
    capsys.readouterr()
    assert main(["annotate", str(folder / "run"), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def annotate(folder, *words):
    return main(["annotate", str(folder / "run"), *words])


def test_an_annotation_is_kept_with_its_contact_when_the_numbers_of_misses_change(folder, capsys):
    first = run(folder)
    stamps = first.assembly.stamp_ns
    assert [(miss.first, miss.last) for miss in first.misses["slow"]][-1] == (13, 13)
    last = len(first.misses["slow"])
    assert annotate(folder, "through the wall", "--miss", str(last), "--tag", "real", "--rater", "anna") == 0
    (one,) = said_of(folder, capsys)
    assert (one["first_ns"], one["last_ns"], one["contact"]) == (stamps[13], stamps[13], f"miss {last} of slow")
    assert one["session"] == first.summary["session"]["digest"] and {one["body_a"], one["body_b"]} == {"a", "b"}
    assert (one["text"], one["tag"], one["rater"]) == ("through the wall", "real", "anna")
    # looks elsewhere: other misses, other numbers
    again = run(folder, "other=discrete[rate_hz=34]")
    numbers = [miss.number for miss in again.misses["other"] if miss.first <= 13 <= miss.last]
    now = f"miss {numbers[0]} of other" if numbers else "no fault in this run"
    assert last not in numbers
    assert said_of(folder, capsys) == [one | {"contact": now}]
    assert "through the wall" in (folder / "run" / "report.html").read_text()
    run(folder, "all=discrete")
    assert said_of(folder, capsys)[0]["contact"] == "no fault in this run"


def test_part_of_a_contact_that_was_missed_stands_for_the_whole_contact(folder, capsys):
    result = run(folder)
    partial = next(miss for miss in result.misses["slow"] if miss.first == 6)
    assert partial.last == 7
    assert annotate(folder, "a graze", "--miss", str(partial.number), "--rater", "anna") == 0
    (one,) = said_of(folder, capsys)
    assert [one["first_ns"], one["last_ns"]] == [int(result.assembly.stamp_ns[k]) for k in (6, 8)]


def test_a_rater_may_change_her_mind_and_another_may_disagree(folder, capsys):
    run(folder)
    for text, tag, rater in (("a", "real", "anna"), ("b", "artefact", "anna"), ("c", "unsure", "ben")):
        assert tag in TAGS
        assert annotate(folder, text, "--miss", "1", "--tag", tag, "--rater", rater) == 0
    assert [(one["text"], one["tag"], one["rater"]) for one in said_of(folder, capsys)] == [
        ("b", "artefact", "anna"), ("c", "unsure", "ben"),
    ]  # fmt: skip


def test_a_false_contact_is_annotated_by_its_own_number(folder, capsys):
    write_session(cubes({"a": [0] * 4, "b": [3, 1.2, 1.2, 3]}), folder / "s.mcap")
    result = run(folder, "round=sphere")
    assert result.false["round"]
    assert annotate(folder, "only the sphere", "--false", "1", "--tag", "artefact", "--rater", "anna") == 0
    assert said_of(folder, capsys)[0]["contact"] == "false 1 of round"


def test_report_and_picture_show_it_escaped_once_each(folder):
    run(folder)
    for rater in ("anna", "ben"):
        assert annotate(folder, HOSTILE, "--miss", "1", "--rater", rater) == 0
    page = (folder / "run" / "report.html").read_text()
    assert page.count("<h2>Annotations</h2>") == 1
    assert page.count("&lt;script&gt;alert(1)") == 2
    assert not any(one in page for one in ("<script>", "\x1b", "\u202e"))
    opened = read_run_folder(folder / "run")
    assert write_layer(opened, folder / "layer.rrd")
    (layer,), (picture,) = RrdReader(folder / "layer.rrd").recordings(), RrdReader(opened.picture).recordings()
    assert (layer.application_id, layer.recording_id) == (picture.application_id, picture.recording_id)
    (chunk,) = RrdReader(folder / "layer.rrd").stream().filter(content="/report").to_chunks()
    batch = chunk.to_record_batch()
    (text,) = next(batch.column(name) for name in batch.schema.names if name.endswith("text")).to_pylist()[0]
    assert text.startswith("## What was said of single contacts") and "anna" in text
    assert "\x1b" not in text and "\u202e" not in text


def test_a_copy_of_the_recording_holds_it_among_its_intervals_and_the_recording_is_as_it_was(folder, capsys):
    result = run(folder)
    before = (folder / "s.mcap").read_bytes()
    assert annotate(folder, "through the wall", "--miss", "1", "--tag", "real", "--rater", "anna") == 0
    assert annotate(folder, "--session-out", str(folder / "with.mcap")) == 0
    assert (folder / "s.mcap").read_bytes() == before
    (one,) = read_session(folder / "with.mcap").intervals
    stamp = int(result.assembly.stamp_ns[2])
    assert (one.start_ns, one.end_ns, one.kind, one.name) == (stamp, stamp, "annotation", "through the wall")
    assert (one.data["tag"], one.data["rater"]) == ("real", "anna")
    again = replay.run(folder / "with.mcap", detectors="slow=discrete[rate_hz=25]", oracle="hybrid")
    assert again.summary["session"]["digest"] == result.summary["session"]["digest"]
    assert again.detections["slow"].digest == result.detections["slow"].digest
    assert annotate(folder, "--session-out", str(folder / "s.mcap"), "--force") == 1
    assert "is the recording itself, which is never changed" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("words", "code", "why"),
    [
        (["x", "--miss", "9", "--rater", "a"], 1, "has no miss 9; they are numbered 1 to"),
        (["x", "--false", "9", "--rater", "a"], 1, "has no false contact 9; they are numbered 1 to 1"),
        (["x", "--miss", "1"], 2, "who says so"),
        (["--miss", "1", "--rater", "a"], 2, "say what it is"),
        (["x", "--rater", "a"], 2, "say of which contact"),
        (["x", "--miss", "1", "--false", "1", "--rater", "a"], 2, "one of --miss N and --false N"),
        (["x" * 2001, "--miss", "1", "--rater", "a"], 2, "the note has 2001 characters"),
        (["x", "--miss", "1", "--rater", "a", "--by", "none"], 1, "has no miss 1 of none; it has none"),
    ],
)
def test_what_cannot_be_annotated_is_said_in_a_sentence(ready, capsys, words, code, why):
    assert annotate(ready, *words) == code
    assert why in " ".join(capsys.readouterr().err.split())
    assert read_annotations(ready / "run") == []


def test_a_number_that_several_detectors_have_asks_for_one_of_them(folder, capsys):
    run(folder, ["slow=discrete[rate_hz=25]", "slower=discrete[rate_hz=12]"])
    assert annotate(folder, "x", "--miss", "1", "--rater", "a") == 1
    assert "add --by with one of: slow, slower" in " ".join(capsys.readouterr().err.split())
    assert annotate(folder, "x", "--miss", "1", "--rater", "a", "--by", "slower") == 0


@pytest.mark.parametrize(
    "text", ["{}", "[1]", "no json", '{"schema": "vrlab-replay/annotations/1", "annotations": [{}]}']
)
def test_a_file_of_annotations_that_is_none_is_left_as_it_is(ready, capsys, text):
    (ready / "run" / "annotations.json").write_text(text)
    assert annotate(ready, "x", "--miss", "1", "--rater", "a") == 1
    assert "holds no annotations" in " ".join(capsys.readouterr().err.split())
    assert (ready / "run" / "annotations.json").read_text() == text
    (ready / "run" / "annotations.json").unlink()


def test_a_page_that_a_proof_seals_stays_as_it_is(folder, capsys):
    replay.run(folder / "s.mcap", detectors="slow=discrete[rate_hz=25]", out=folder / "run", proof=True)
    before = (folder / "run" / "report.html").read_bytes()
    assert annotate(folder, "x", "--miss", "1", "--rater", "a") == 0
    assert (folder / "run" / "report.html").read_bytes() == before
    assert main(["verify", str(folder / "run")]) == 0


def test_nothing_said_is_said(ready, capsys):
    assert annotate(ready) == 0
    assert "nothing is said of" in capsys.readouterr().out
