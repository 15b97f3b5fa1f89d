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
    """Returns what a verb prints, to be drawn at any width; each runs once."""
    folder = tmp_path_factory.mktemp("shown")
    names = {"small-beaker": [0] * 12, "hand-left-glove": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    write_session(unit_cubes_on_x(names), folder / "s.mcap")

    @cache
    def screen(verb):
        kept = []
        if verb == "diff":
            screen("first")  # it reads the folders of two runs
            screen("run")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(advisor, "find_spec", lambda name: None)
            patch.setattr(console_module, "stdout_console", lambda: Keeping(kept))
            patch.chdir(folder)
            assert main([item.format(s=folder / "s.mcap", t=folder) for item in VERBS[verb]]) == 0, verb
        return kept

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
    """The output of a verb is drawn on terminals of 60, 80, 100 and 140 columns, and of 1000, where nothing folds.

    No line is longer than the terminal, and all have the words of the widest: none is cut.
    """
    screen = screen_of(verb)
    unfolded = at_width(screen, width=1000)
    assert unfolded
    for width in WIDTHS:
        lines = at_width(screen, width)
        assert max(map(len, lines)) <= width, width
        assert distinct_tokens(lines) == distinct_tokens(unfolded), width


TABLE_OF_TWO_DETECTORS = table(
    "18 contacts",
    ("detector", "missed", "of a 90 Hz frame", "why"),
    [("hull50", "0.50 [0.075, 2.9]", "1.4 %", "colliders meet, surfaces do not"), ("exact", 0, "0.53 %", "")],
    words=("detector", "why"),
    notes=["Over 16 sampling offsets: hull50."],
)


def test_word_wider_than_the_terminal_is_folded_beside_its_row():
    """A table has a row "first" with a name of 30 letters, on a terminal of 20 columns.

    Less "first" and two blanks 13 columns are left: the letters stand in lines of 13, 13 and 4.
    """
    lines = at_width([stacked(table("", ("row", "name"), [("first", "x" * 30)], words=("row", "name")))], width=20)
    assert max(map(len, lines)) <= 20
    assert lines[-3:] == ["first  " + "x" * 13, " " * 7 + "x" * 13, " " * 7 + "xxxx"]


@pytest.mark.parametrize(
    ("width", "blocks"),
    [(34, ["row a b", "row c d", "row e f"]), (33, ["row a", "row b", "row c", "row d", "row e", "row f"])],
)
def test_wide_table_continues_in_blocks_that_fit_exactly(width, blocks):
    """A table of seven columns of ten letters, with gaps of two blanks: three columns take 3 x 10 + 2 x 2 = 34.

    ``blocks``: headings of the blocks into which it is split; the first column begins each.
    """
    names = ("row", *"abcdef")
    lines = at_width([stacked(table("", names, [["x" * 10] * len(names)], words=names))], width)
    assert [" ".join(text.split()) for text in lines if text.startswith("row")] == blocks
    assert max(map(len, lines)) <= width


@pytest.mark.parametrize(("columns", "widest"), [(None, 100), ("60", 60), ("140", 140)])
def test_piped_output_follows_columns_without_trailing_spaces(monkeypatch, capsys, columns, widest):
    """``columns``: the variable COLUMNS of the environment, which says how wide a pipe is; without it it is 100.

    A line of 80 words of four letters comes to within a word of that.
    """
    monkeypatch.delenv("COLUMNS")
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    console_module.answer(False, None, lambda: stacked(line("word " * 80), TABLE_OF_TWO_DETECTORS))
    lines = capsys.readouterr().out.splitlines()
    assert widest - len("word ") <= max(map(len, lines)) <= widest
    assert not [text for text in lines if text != text.rstrip()]


LONG_NOTE = "  note: " + "word " * 30 + "/a/path/that/is/longer/than/the/terminal/is/wide/by/far.mcap"


def test_long_sentence_is_not_folded_in_a_pipe(monkeypatch, capsys):
    """A pipe has no width, and COLUMNS is not set: the answer stays one line."""
    monkeypatch.delenv("COLUMNS")
    console_module.answer(False, None, lambda: LONG_NOTE)
    assert capsys.readouterr().out == LONG_NOTE + "\n"


def test_long_sentence_is_folded_in_a_terminal(monkeypatch, capsys):
    """40 columns: lines after the first are indented; a path longer than the terminal, in the last, is not broken."""
    monkeypatch.setenv("COLUMNS", "40")
    console_module.People().say(LONG_NOTE)
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(" ".join(lines).split()) == " ".join(LONG_NOTE.split())
    *folded, line_of_path = lines
    assert folded[1].startswith("    word")
    assert max(map(len, folded)) <= 40 < len(line_of_path)


def test_name_never_becomes_markup_or_an_extra_cell():
    """A Markdown table has a body's name with a link, an HTML image and the bar between cells: they are escaped."""
    hostile = "a](http://x.y)<img src=x>|b"
    _heading, _rule, *rows = markdown(table("", ("pair", "frames"), [(hostile, 1), ("all", 1234)])).splitlines()
    assert rows == [r"| a]\(http://x.y)\<img src=x>\|b | 1 |", "| all | 1,234 |"]


@pytest.mark.parametrize(("count", "notes"), [(20, ()), (22, ("… and 2 more",))])
def test_of_many_sessions_twenty_are_listed(count, notes):
    """A table of ``count`` sessions of 3 frames has twenty rows, and a last one with the sum of all."""
    session = structs.replace(EMPTY.session, frames=3)
    run = SessionOfBatch.of(document_with(session=session))
    sessions = session_table(SimpleNamespace(audit={}, runs={f"s{k}": run for k in range(count)}))
    _name, frames, *_more_columns = sessions.rows[-1]
    assert len(sessions.rows) == 20 + 1 and frames == 3 * count
    assert tuple(sessions.notes) == notes


COMMAND = 'replay run long/session.mcap --detectors "collider[shape=compound,cut=beaker+flask,rate_hz=50]" --out b'


@pytest.mark.skipif(shutil.which("sh") is None, reason="no POSIX shell")
@pytest.mark.parametrize("width", [30, 60, 80, 200])
def test_continued_command_is_a_single_shell_command(width):
    """A command of 111 letters is folded to a terminal's width, to be copied: a shell splits it as if it were not.

    30 columns are less than its longest word, which is not broken.
    """
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
    """A path of 151 letters in 40 columns, in a paragraph and in a command: not broken, so that it can be copied."""
    monkeypatch.setenv("COLUMNS", "40")
    path = "folder/" * 20 + "report.html"
    console_module.show(Paragraph("Read it  ", path))
    console_module.show(Command(f"replay view {path} --false 3"))
    assert capsys.readouterr().out.count(path) == 2


def test_counts_of_sessions_are_added_with_their_ranges():
    """A count that depends on where sampling starts has a smallest, a largest and a mean; another is one number.

    0 to 2 (0.5 in the mean) and 3 are 3 to 5 (3.5), written as "3-5".
    """
    by_offset, certain = Count(0, 2, 0.5), Count.without_offsets(3)
    total = by_offset + certain
    assert total == Count(3, 5, 3.5)
    assert (total.cell, certain.cell) == ("3-5", 3)
