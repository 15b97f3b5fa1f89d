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

POSITION = {"label": "hull", "kind": "miss", "number": 1, "session_ns": 5, "leads": True}

CHANGES = [{"session_ns": 0.5}, {"number": None}, {"kind": ["miss"]}, {"unknown": 1}]


@pytest.mark.slow
def test_number_leads_to_its_moment_and_wrong_number_is_refused(recording):
    """Each bookmark of the recording is asked for by its number, with and without the name of its detector."""
    for bookmark in read_bookmarks(recording):
        requested = {"miss": (bookmark.number, None), "false": (None, bookmark.number)}.get(bookmark.kind)
        for by in ("", bookmark.label) if requested else ():
            assert target_ns(recording, *requested, by) == bookmark.session_ns
    with pytest.raises(RunFolderError, match=r"there is no false 999 in .*; its false contacts are numbered 1 to \d+"):
        target_ns(recording, miss=None, false=999, by="")
    with pytest.raises(RunFolderError, match=r"there is no miss 1 in .*; it has none"):
        target_ns(recording, miss=1, false=None, by="nobody")


@pytest.mark.parametrize("content", [b"", b"not a recording", b"RRF2", bytes(100), "a third"])
def test_damaged_recording_is_one_clear_error(recording, tmp_path, content):
    """``content``: of the file; a third: the first third of a whole recording."""
    whole = recording.read_bytes()
    (tmp_path / "run.rrd").write_bytes(whole[: len(whole) // 3] if content == "a third" else content)
    with pytest.raises(RunFolderError, match=r"run\.rrd is damaged; run its session again$"):
        read_bookmarks(tmp_path / "run.rrd")


CHANGED_POSITIONS = [{"label": "hull"}, *(POSITION | change for change in CHANGES)]


@pytest.mark.parametrize(
    "moments", ["", "{", "[1]", "null", "[" * 100_000, *(json.dumps([position]) for position in CHANGED_POSITIONS)]
)
def test_picture_with_malformed_moments_is_refused_as_damaged(tmp_path, moments):
    """``moments``: no JSON, no list of moments, or moments that lack a field, have another type or one more."""
    with recording_file("test", tmp_path / "run.rrd", rrb.Blueprint(rrb.Spatial3DView(origin="/"))) as stream:
        stream.log("moments/table", rr.AnyValues(moments=moments), static=True)
    with pytest.raises(RunFolderError, match=r"run\.rrd is damaged; run its session again$"):
        read_bookmarks(tmp_path / "run.rrd")


def test_picture_of_an_earlier_version_is_refused(tmp_path):
    """Moments stood there in columns, and not in one text."""
    with recording_file("test", tmp_path / "run.rrd", rrb.Blueprint(rrb.Spatial3DView(origin="/"))) as stream:
        stream.log("moments/table", rr.AnyValues(label=["slow"], kind=["miss"], number=[1]), static=True)
    with pytest.raises(RunFolderError, match="earlier version; run its session again"):
        target_ns(tmp_path / "run.rrd", miss=1, false=None, by="")


@pytest.mark.slow
def test_characters_missing_in_the_viewer_font_become_numbers(demo, drawn):
    """The sign for hand, U+624B, is in the name of the scene and of a body."""
    scene = replace(demo.session.scene, name="手 at the bench")
    bodies = tuple(replace(item, name="手") if item.name == "rod" else item for item in demo.assembly.bodies)
    run = replace(demo, session=replace(demo.session, scene=scene), assembly=replace(demo.assembly, bodies=bodies))
    recorded = drawn(run)
    assert "/world/u624b" in recorded.entities and not [path for path in recorded.entities if "手" in path]
    text = recording_text(recorded.path)
    assert "u624b at the bench" in text and "手" not in text and "beaker-u624b" in text
