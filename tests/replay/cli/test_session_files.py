"""Sessions by name, by folder and by a list; what a list says of no file is named with its line."""

import click
import pytest

from replay.cli.main import main
from replay.cli.session_files import are_several, session_files
from replay.errors import PlaceError


@pytest.fixture
def folder_with_two_sessions(tmp_path):
    """A folder with a.mcap, b.mcap and notes.csv, all empty."""
    for name in ("a.mcap", "b.mcap", "notes.csv"):
        (tmp_path / name).write_bytes(b"")
    return tmp_path


def test_list_resolves_files_from_its_folder_and_skips_comments(folder_with_two_sessions, monkeypatch):
    """Paths may be indented, absolute and named twice; the current folder is another one."""
    listed = folder_with_two_sessions / "list.txt"
    listed.write_text(
        f"# the first week\nb.mcap\n\n  a.mcap  # twice\n{folder_with_two_sessions / 'a.mcap'}\n", "utf-8"
    )
    monkeypatch.chdir("/")
    assert session_files([listed]) == [folder_with_two_sessions / name for name in ("b.mcap", "a.mcap", "a.mcap")]
    assert session_files([folder_with_two_sessions, folder_with_two_sessions / "b.mcap"]) == [
        folder_with_two_sessions / name for name in ("a.mcap", "b.mcap", "b.mcap")
    ]
    assert (
        are_several([listed])
        and are_several([folder_with_two_sessions])
        and not are_several([folder_with_two_sessions / "a.mcap"])
    )


def test_unreachable_store_in_a_list_is_one_clear_error(folder_with_two_sessions, monkeypatch):
    """A session whose store fails, and a list that its store does not have."""
    pytest.importorskip("upath")
    (folder_with_two_sessions / "list.txt").write_text("memory://class/one.mcap\n", "utf-8")
    (file,) = session_files([folder_with_two_sessions / "list.txt"])
    assert str(file) == "memory://class/one.mcap"
    monkeypatch.setattr(file.fs, "isdir", lambda path: 1 / 0, raising=True)
    for unreachable in (file, file.parent / "list.txt"):
        with pytest.raises(PlaceError, match=f"{unreachable} cannot be reached"):
            session_files([unreachable])
        monkeypatch.undo()


@pytest.mark.parametrize(
    "text, message",
    [
        (b"a.mcap\ngone.mcap\n", r"list.txt, line 2: .*gone.mcap is no file"),
        (b"# nothing yet\n", "holds no line with a session file"),
        (b"\x80\xfe", "is no text in UTF-8"),
    ],
)
def test_list_without_a_session_is_named_with_its_mistake(folder_with_two_sessions, text, message):
    """A file that is not there, no line at all, and bytes that are no text."""
    (folder_with_two_sessions / "list.txt").write_bytes(text)
    with pytest.raises(click.UsageError, match=message):
        session_files([folder_with_two_sessions / "list.txt"])


@pytest.mark.parametrize(
    ("sessions", "options"),
    [(["a.mcap", "b.mcap"], []), (["only"], []), (["a.mcap"], ["--scheduler", "tcp://host:1", "--out", "runs"])],
)
def test_several_sessions_or_a_scheduler_make_a_batch(folder_with_two_sessions, monkeypatch, sessions, options):
    """A folder is a batch though it holds one session."""
    (folder_with_two_sessions / "only").mkdir()
    (folder_with_two_sessions / "only" / "c.mcap").write_bytes(b"")
    monkeypatch.chdir(folder_with_two_sessions)
    batches = []
    monkeypatch.setattr("replay.cli.many_sessions.run_many", lambda files, *_, **options: batches.append(options) or 0)
    assert main(["run", *sessions, *options]) == 0
    assert [batch["settings"]["fix_time"] for batch in batches] == [0.0]
    batches.clear()
    assert main(["run", *sessions, *options, "--fix-time", "7"]) == 0
    assert [batch["settings"]["fix_time"] for batch in batches] == [7.0]


def test_scheduler_needs_a_folder_that_workers_reach(folder_with_two_sessions, capsys):
    """``--out`` names it."""
    assert main(["run", str(folder_with_two_sessions / "a.mcap"), "--scheduler", "tcp://host:1"]) == 2
    assert "--out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("names", "are"), [(["a.mcap"], False), (["a.mcap", "list.txt"], True), (["a.mcap", "."], True), ([], False)]
)
def test_folder_or_list_means_several_sessions(names, are, tmp_path):
    """``.`` is a folder, and ``.txt`` ends the name of a list."""
    assert are_several([tmp_path / name for name in names]) == are
