"""A number leads to its moment; a wrong one, a file that is none and letters without a glyph are said plainly."""

import json
from dataclasses import replace

import pytest
import rerun as rr
import rerun.blueprint as rrb
from support.viewers import recording_text

from replay.errors import RunFolderError
from replay.show.rerun_log.moments import read_bookmarks
from replay.show.rerun_log.recording_file import recording_file
from replay.show.rerun_log.viewer import target_ns

BOOKMARK = {"label": "hull", "kind": "miss", "number": 1, "session_ns": 5, "leads": True}
"""A moment as a recording has it in JSON."""


@pytest.mark.slow
def test_number_of_a_fault_leads_to_its_moment(recording):
    """Each miss and false contact of a recording is requested by its number, without and with its detector's name."""
    bookmarks = [bookmark for bookmark in read_bookmarks(recording) if bookmark.kind in ("miss", "false")]
    assert bookmarks
    for bookmark in bookmarks:
        number_of_kind = {"miss": None, "false": None} | {bookmark.kind: bookmark.number}
        for detector in ("", bookmark.label):
            assert target_ns(recording, **number_of_kind, by=detector) == bookmark.session_ns


@pytest.mark.slow
@pytest.mark.parametrize(
    ("requested", "message"),
    [
        pytest.param(
            {"miss": None, "false": 999, "by": ""},
            r"there is no false 999 in .*; its false contacts are numbered 1 to \d+",
            id="number too large",
        ),
        pytest.param(
            {"miss": 1, "false": None, "by": "nobody"}, r"there is no miss 1 in .*; it has none", id="unknown detector"
        ),
    ],
)
def test_unknown_number_of_a_fault_is_refused(recording, requested, message):
    """A fault is requested by its number, as a miss or a false contact, and by its detector (``by``, "": any).

    The recording has far fewer than 999 false contacts, and no detector is called nobody.
    """
    with pytest.raises(RunFolderError, match=message):
        target_ns(recording, **requested)


MALFORMED_MOMENTS = {
    "empty": "",
    "no JSON": "{",
    "a number for a moment": "[1]",
    "null": "null",
    "deeply nested": "[" * 100_000,
    "fields lacking": json.dumps([{"label": "hull"}]),
    "time that is no integer": json.dumps([BOOKMARK | {"session_ns": 0.5}]),
    "no number": json.dumps([BOOKMARK | {"number": None}]),
    "list for a kind": json.dumps([BOOKMARK | {"kind": ["miss"]}]),
    "field too many": json.dumps([BOOKMARK | {"unknown": 1}]),
}


def write_recording_with_moments(file, **columns):
    """Writes a recording that has nothing but the entity of moments, with these columns."""
    with recording_file("test", file, rrb.Blueprint(rrb.Spatial3DView(origin="/"))) as stream:
        stream.log("moments/table", rr.AnyValues(**columns), static=True)


def test_moments_of_a_recording_are_read_from_json(tmp_path):
    """A recording has its moments as one text, JSON: here miss 1 of ``hull``, 5 ns after the session began."""
    write_recording_with_moments(tmp_path / "run.rrd", moments=json.dumps([BOOKMARK]))
    (bookmark,) = read_bookmarks(tmp_path / "run.rrd")
    assert (bookmark.label, bookmark.kind, bookmark.number, bookmark.session_ns) == ("hull", "miss", 1, 5)


def refusal_of(file):
    """The message with which the moments of a recording are refused; "" where they are read."""
    try:
        read_bookmarks(file)
    except RunFolderError as error:
        return str(error)
    return ""


def test_damaged_recording_is_a_clear_error(tmp_path):
    """Moments are read from a whole recording; in its place stand files without any, or the first third of it."""
    write_recording_with_moments(tmp_path / "whole.rrd", moments=json.dumps([BOOKMARK]))
    whole = (tmp_path / "whole.rrd").read_bytes()
    contents = {
        "empty": b"",
        "text": b"not a recording",
        "first four bytes": b"RRF2",
        "zeros": bytes(100),
        "first third": whole[: len(whole) // 3],
    }
    assert refusal_of(tmp_path / "whole.rrd") == ""
    for name, content in contents.items():
        (tmp_path / "run.rrd").write_bytes(content)
        assert refusal_of(tmp_path / "run.rrd").endswith("run.rrd is damaged; run its session again"), name


def test_picture_with_malformed_moments_is_refused_as_damaged(tmp_path):
    """Recordings have their moments as one text, JSON with a list of objects; here these texts are others."""
    for name, text in MALFORMED_MOMENTS.items():
        write_recording_with_moments(tmp_path / "run.rrd", moments=text)
        assert refusal_of(tmp_path / "run.rrd").endswith("run.rrd is damaged; run its session again"), name


def test_picture_of_an_earlier_version_is_refused(tmp_path):
    """Earlier versions wrote moments as columns (label, kind, number), and not as one text."""
    write_recording_with_moments(tmp_path / "run.rrd", label=["slow"], kind=["miss"], number=[1])
    with pytest.raises(RunFolderError, match="earlier version; run its session again"):
        target_ns(tmp_path / "run.rrd", miss=1, false=None, by="")


@pytest.mark.slow
def test_characters_missing_in_the_viewer_font_become_numbers(demo, drawn):
    """The sign for hand, 手 (U+624B), is in the name of the scene and is the name of the rod: each becomes u624b.

    A path, the name of the scene and that of a pair of bodies have it.
    """
    scene = replace(demo.session.scene, name="手 at the bench")
    bodies = tuple(replace(body, name="手") if body.name == "rod" else body for body in demo.assembly.bodies)
    run = replace(demo, session=replace(demo.session, scene=scene), assembly=replace(demo.assembly, bodies=bodies))
    recorded = drawn(run)
    assert "/world/u624b" in recorded.entities
    assert [path for path in recorded.entities if "手" in path] == []
    text = recording_text(recorded.path)
    assert "u624b at the bench" in text
    assert "beaker-u624b" in text
    assert "手" not in text
