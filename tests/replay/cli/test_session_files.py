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
    """A list names b.mcap and, indented and as an absolute path, a.mcap; the current folder is another one."""
    folder = folder_with_two_sessions
    (folder / "list.txt").write_text(f"# the first week\nb.mcap\n\n  a.mcap  # twice\n{folder / 'a.mcap'}\n", "utf-8")
    monkeypatch.chdir("/")
    assert session_files([folder / "list.txt"]) == [folder / name for name in ("b.mcap", "a.mcap", "a.mcap")]


def test_folder_gives_its_sessions_in_order_of_name(folder_with_two_sessions):
    """A folder with a.mcap, b.mcap and notes.csv, which is no session, and b.mcap by its own name, are requested."""
    folder = folder_with_two_sessions
    assert session_files([folder, folder / "b.mcap"]) == [folder / name for name in ("a.mcap", "b.mcap", "b.mcap")]


def test_unreachable_store_of_a_session_is_a_clear_error(folder_with_two_sessions, monkeypatch):
    """A list names a session in an object store, and the store fails with an error of its own."""
    pytest.importorskip("upath")
    (folder_with_two_sessions / "list.txt").write_text("memory://class/one.mcap\n", "utf-8")
    (file,) = session_files([folder_with_two_sessions / "list.txt"])
    assert str(file) == "memory://class/one.mcap"
    monkeypatch.setattr(file.fs, "isdir", lambda path: 1 / 0, raising=True)
    with pytest.raises(PlaceError, match=f"{file} cannot be reached"):
        session_files([file])


def test_list_that_its_store_lacks_is_a_clear_error():
    """memory:// is a store in memory, which is empty."""
    upath = pytest.importorskip("upath")
    missing = upath.UPath("memory://class/list.txt")
    with pytest.raises(PlaceError, match=f"{missing} cannot be reached"):
        session_files([missing])


@pytest.mark.parametrize(
    "text, message",
    [
        (b"a.mcap\ngone.mcap\n", r"list.txt, line 2: .*gone.mcap is no file"),
        (b"# nothing yet\n", "holds no line with a session file"),
        (b"\x80\xfe", "is no text in UTF-8"),
    ],
    ids=["a file that is not there", "no line", "no text"],
)
def test_list_without_a_session_is_named_with_its_mistake(folder_with_two_sessions, text, message):
    """``text``: bytes of a list of sessions; ``message``: of the error, a pattern."""
    (folder_with_two_sessions / "list.txt").write_bytes(text)
    with pytest.raises(click.UsageError, match=message):
        session_files([folder_with_two_sessions / "list.txt"])


@pytest.mark.parametrize("fix_time", [None, 7.0], ids=["no --fix-time", "--fix-time 7"])
@pytest.mark.parametrize(
    ("sessions", "options"),
    [
        (["a.mcap", "b.mcap"], []),
        (["folder-of-one-session"], []),
        (["a.mcap"], ["--scheduler", "tcp://host:1", "--out", "runs"]),
    ],
    ids=["two files", "a folder", "a scheduler"],
)
def test_several_sessions_or_a_scheduler_make_a_batch(
    folder_with_two_sessions, monkeypatch, sessions, options, fix_time
):
    """`replay run` hands these sessions to ``run_many``, a folder too, though only one session is in it.

    No time is spent on the search for better colliders of each session, unless ``--fix-time`` says how many seconds.
    """
    (folder_with_two_sessions / "folder-of-one-session").mkdir()
    (folder_with_two_sessions / "folder-of-one-session" / "c.mcap").write_bytes(b"")
    monkeypatch.chdir(folder_with_two_sessions)
    batches = []
    monkeypatch.setattr("replay.cli.many_sessions.run_many", lambda files, *_, **options: batches.append(options) or 0)
    time_options = [] if fix_time is None else ["--fix-time", str(fix_time)]
    assert main(["run", *sessions, *options, *time_options]) == 0
    assert [batch["settings"]["fix_time"] for batch in batches] == [fix_time or 0.0]


def test_scheduler_needs_a_folder_that_workers_reach(folder_with_two_sessions, capsys):
    """A scheduler spreads runs over machines; without ``--out``, a folder for them, the call is wrong (2)."""
    assert main(["run", str(folder_with_two_sessions / "a.mcap"), "--scheduler", "tcp://host:1"]) == 2
    assert "--scheduler needs --out, a folder that all its workers reach" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("names", "several"),
    [
        (["a.mcap"], False), (["."], True), (["list.txt"], True), (["a.mcap", "list.txt"], True),
        (["a.mcap", "."], True), ([], False),
    ],
)  # fmt: skip
def test_folder_or_list_means_several_sessions(names, several, tmp_path):
    """``.`` is a folder, and ``.txt`` ends the name of a list."""
    assert are_several([tmp_path / name for name in names]) == several
