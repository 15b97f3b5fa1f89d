"""A terminal shows every cell whole, and red is for misses alone."""

import io
import shlex
import shutil
import subprocess
from functools import cache
from types import SimpleNamespace

import pytest
from msgspec import structs
from rich.console import Console
from support.report_states import EMPTY, document_with
from support.small_worlds import unit_cubes_on_x

from replay.cli import console as console_module
from replay.cli.main import main
from replay.cli.many_sessions import Count, session_table
from replay.cli.terminal import Command, Paragraph, line, stacked
from replay.document.tables import markdown, table
from replay.running import advisor
from replay.running.batch import SessionOfBatch
from sessions import write_session

WIDTHS = (60, 80, 100, 140)
SLOW, HULL = "slow=discrete[rate_hz=20]", "hull=collider[shape=hull,rate_hz=50]"
VERBS = {
    "first": ["run", "{s}", "--detectors", SLOW, "--out", "{t}/a", "--no-picture"],
    "run": ["run", "{s}", "--detectors", f"{SLOW},{HULL}", "--out", "b", "--no-picture"],
    "run -v": ["run", "-v", "{s}", "--detectors", f"{SLOW},{HULL}"],
    "diff": ["diff", "{t}/a", "{t}/b"],
    "info": ["info", "{s}"],
    "doctor": ["doctor", "-v", "{s}"],
    "engine": ["tradeoff", "{s}", "--engine", "unity"],
    "tradeoff": ["tradeoff", "{s}", "--detectors", "exact,discrete[rate_hz=20]"],
    "stress": ["stress", "--detectors", "exact,sphere", "--family", "1-2", "--pairs", "10"],
    "study": ["study", "check"],
}


class Keeping(Console):
    """A console that keeps what is printed, to be drawn later."""

    def __init__(self, kept):
        super().__init__(file=io.StringIO())
        self.kept = kept

    def print(self, displayed, **_):
        """Draw nothing."""
        self.kept.append(displayed)


@pytest.fixture(scope="module")
def screen_of(tmp_path_factory):
    """Returns what a verb prints, to be drawn at any width; each runs once, after a first run."""
    folder = tmp_path_factory.mktemp("shown")
    names = {"small-beaker": [0] * 12, "hand-left-glove": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    write_session(unit_cubes_on_x(names), folder / "s.mcap")

    @cache
    def screen(verb):
        kept = []
        if verb == "diff":
            screen("run")  # whose folder it reads
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(advisor, "find_spec", lambda name: None)
            patch.setattr(console_module, "stdout_console", lambda: Keeping(kept))
            patch.chdir(folder)
            assert main([item.format(s=folder / "s.mcap", t=folder) for item in VERBS[verb]]) == 0, verb
        return kept

    screen("first")
    return screen


def at_width(drawn, width):
    """Lines of what was drawn, as they are piped."""
    console = Console(width=width, file=io.StringIO())
    for item in drawn:
        console.print(item)
    return [text.rstrip() for text in console.file.getvalue().splitlines()]


def distinct_tokens(lines):
    """The words of these lines without rules."""
    return {word for line in lines for word in line.split() if set(word) - set("─\\")}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("verb", [*VERBS][1:])
def test_every_word_and_number_is_whole_at_every_width(screen_of, verb):
    """No line is longer than the terminal, and none of its words is cut."""
    screen = screen_of(verb)
    wide = at_width(screen, width=1000)
    assert wide
    for width in WIDTHS:
        lines = at_width(screen, width)
        assert max(map(len, lines)) <= width and distinct_tokens(lines) == distinct_tokens(wide), width


SNAPSHOT = table(
    "18 contacts",
    ("detector", "missed", "of a 90 Hz frame", "why"),
    [("hull50", "0.50 [0.075, 2.9]", "1.4 %", "colliders meet, surfaces do not"), ("exact", 0, "0.53 %", "")],
    words=("detector", "why"),
    notes=["Over 16 sampling offsets: hull50."],
)


def test_word_wider_than_the_terminal_is_folded_beside_its_row():
    """20 columns less "first" and two blanks leave 13: 30 letters are lines of 13, 13 and 4."""
    lines = at_width([stacked(table("", ("row", "name"), [("first", "x" * 30)], words=("row", "name")))], width=20)
    assert max(map(len, lines)) <= 20 and lines[-3:] == ["first  " + "x" * 13, " " * 7 + "x" * 13, " " * 7 + "xxxx"]


def test_wide_table_continues_in_blocks_that_fit_exactly():
    """Ten letters each and gaps of two blanks: three columns take 34, and the first column begins every block."""
    names = ("row", *"abcdef")
    for width, blocks in ((34, ["row a b", "row c d", "row e f"]), (33, [f"row {name}" for name in "abcdef"])):
        lines = at_width([stacked(table("", names, [["x" * 10] * len(names)], words=names))], width)
        assert [" ".join(text.split()) for text in lines if text.startswith("row")] == blocks
        assert max(map(len, lines)) <= width


@pytest.mark.parametrize(("columns", "widest"), [(None, console_module.PIPED_WIDTH), ("60", 60), ("140", 140)])
def test_piped_output_follows_columns_without_trailing_spaces(monkeypatch, capsys, columns, widest):
    """``COLUMNS`` says how wide it is; without it 100 columns are."""
    monkeypatch.delenv("COLUMNS")
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    console_module.answer(False, None, lambda: stacked(line("word " * 80), SNAPSHOT))
    lines = capsys.readouterr().out.splitlines()
    assert widest - 5 <= max(map(len, lines)) <= widest
    assert not [text for text in lines if text != text.rstrip()]


def test_long_sentence_is_folded_in_terminals_but_not_pipes(monkeypatch, capsys):
    """A path longer than the terminal is not broken."""
    text = "  note: " + "word " * 30 + "/a/path/that/is/longer/than/the/terminal/is/wide/by/far.mcap"
    monkeypatch.delenv("COLUMNS")
    console_module.answer(False, None, lambda: text)
    assert capsys.readouterr().out == text + "\n"
    monkeypatch.setenv("COLUMNS", "40")
    console_module.People().say(text)
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(" ".join(lines).split()) == " ".join(text.split()) and lines[1].startswith("    word")
    assert [len(item) <= 40 for item in lines] == [True] * (len(lines) - 1) + [False]


def test_name_never_becomes_markup_or_an_extra_cell():
    """A body's name with a link, an image and a bar of a table."""
    hostile = ("a](http://x.y)<img src=x>|b", 1)
    lines = markdown(table("", ("pair", "frames"), [hostile, ("all", 1234)])).splitlines()
    assert lines[2:] == [r"| a]\(http://x.y)\<img src=x>\|b | 1 |", "| all | 1,234 |"]


@pytest.mark.parametrize(("count", "notes"), [(20, ()), (22, ("… and 2 more",))])
def test_of_many_sessions_twenty_are_listed(count, notes):
    """Sessions of 3 frames; the last row is their sum."""
    session = structs.replace(EMPTY.session, frames=3)
    run = SessionOfBatch.of(document_with(session=session))
    made = session_table(SimpleNamespace(audit={}, runs={f"s{k}": run for k in range(count)}))
    _all, frames, *_ = made.rows[-1]
    assert len(made.rows) == 21 and tuple(made.notes) == notes and frames == 3 * count


COMMAND = 'replay run long/session.mcap --detectors "collider[shape=compound,cut=beaker+flask,rate_hz=50]" --out b'


@pytest.mark.skipif(shutil.which("sh") is None, reason="no POSIX shell")
@pytest.mark.parametrize("width", [30, 60, 80, 200])
def test_continued_command_is_a_single_shell_command(width):
    """A shell splits the folded lines into the arguments of the whole; 30 columns are less than its longest word."""
    console = Console(file=io.StringIO(), width=width)
    console.print(Command(COMMAND), crop=False)
    printed = console.file.getvalue()
    arguments = subprocess.run(
        ["sh", "-c", f"printf '%s\\n' {printed}"], capture_output=True, text=True, check=True
    ).stdout
    assert arguments.splitlines() == shlex.split(COMMAND)
    if width >= 60:
        assert max(map(len, printed.splitlines())) <= width


def test_long_paths_are_printed_whole_on_narrow_terminals(capsys, monkeypatch):
    """151 letters in 40 columns, in a paragraph and in a command, to be copied."""
    monkeypatch.setenv("COLUMNS", "40")
    path = "folder/" * 20 + "report.html"
    console_module.show(Paragraph("Read it  ", path))
    console_module.show(Command(f"replay view {path} --false 3"))
    assert capsys.readouterr().out.count(path) == 2


def test_counts_of_sessions_are_added_with_their_ranges():
    """A count that depends on where sampling starts is written from its smallest to its largest."""
    total = Count(0, 2, 0.5) + Count.without_offsets(3)
    assert total == Count(3, 5, 3.5)
    assert (total.cell, Count.without_offsets(3).cell) == ("3-5", 3)
