"""One result, one set of numbers: of letters, tables and every output the same, each computed once."""

import json
import os
import re
import sys
from collections import Counter
from html import unescape
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import pyarrow.parquet as pq
import pytest
import rerun as rr
from rich.console import Console
from support.planted_sessions import STATES, missed, outcomes, run, runs_of
from support.small_worlds import unit_cubes_on_x
from support.viewers import recording_text

import replay
from replay.cli.run_markdown import run_markdown
from replay.cli.run_report import run_json
from replay.cli.run_tables import run_screen, run_tables
from replay.cli.terminal import stacked
from replay.show.report.fault_cards import cards
from replay.show.report.page import report_html, view_of
from replay.show.rerun_log.moments import key_moments, log_moment_lists
from replay.show.rerun_log.recording_file import RecordingClock, RecordingWriter
from replay.show.results.parquet import with_keys
from replay.show.results.run_folder import write_run_folder
from replay.show.sections import SectionName, section_of

TOOL = f"{Path(replay.__file__).parent}{os.sep}"


def terminal_text(*displayed):
    """Text of these pieces on a wide terminal."""
    console = Console(width=200, file=StringIO())
    for piece in displayed:
        console.print(piece)
    return console.file.getvalue()


def split_lines(text, beginning):
    """The words of each line that begins so."""
    return [line.split() for line in text.splitlines() if line.startswith(beginning)]


QUICK_STATES = ("several", "undecided", "false at both ends", "more than a list holds")
"""Of all: late and missed contacts, undecided frames, false ones on both sides of a contact, and a cut list."""

MOST_LISTED = 20
"""Misses in a list of the terminal; the others are counted in a last line."""


def expected_counts(truth, answer):
    """Counts made from letters a frame: ``truth`` of the reference, ``answer`` of the detector, of one pair of cubes.

    ``C`` and ``c`` are contact, ``.`` and ``n`` none, ``u`` is undecided. A contact is missed if the detector says
    ``n`` in all its frames, and late or cut short if it says ``n`` in some.
    """
    outcome = outcomes(truth, answer)
    contact_count, misses = missed(truth, answer)
    outcomes_of_contact = [
        set(outcome[first : first + count]) for first, count, letter in runs_of(truth) if letter == "C"
    ]
    return SimpleNamespace(
        contacts=contact_count,
        contacts_missed=outcomes_of_contact.count({"MISSED"}),
        late_or_cut_short=outcomes_of_contact.count({"MISSED", "both"}),
        contacts_undecided=outcomes_of_contact.count({"left out"}),
        misses=misses,  # (number of the contact, first frame, frames)
        false_contacts=[(first, count) for first, count, word in runs_of(outcome) if word == "false"],
        frames={word: outcome.count(word) for word in ("both", "MISSED", "false", "within tolerance", "left out")},
    )


@pytest.fixture(
    scope="module",
    params=[pytest.param(state, marks=() if state in QUICK_STATES else pytest.mark.slow) for state in STATES],
)
def written_run(request, tmp_path_factory):
    """A run of a detector ``it`` on one pair of cubes, a-b: its folder and texts, and counts made by hand.

    The run follows letters, a frame each: contact of the reference, and what the detector says.
    """
    truth, answer, headline = STATES[request.param]
    result, folder = run(request.param), tmp_path_factory.mktemp("run") / "run"
    write_run_folder(result, folder, picture=True)
    return SimpleNamespace(
        result=result,
        folder=folder,
        headline=headline,
        expected=expected_counts(truth, answer),
        rows={name: table.plain() for name, table in result.tables.items()},
        screen=terminal_text(run_screen(result)),
        tables=terminal_text(run_tables(result)),
        page=(folder / "report.html").read_text(encoding="utf-8"),
        picture=recording_text(folder / "run.rrd"),
        markdown=run_markdown(result, ()),
        notebook=repr(replay.RunResult.of(result)),
    )


def test_tables_list_planted_misses_and_false_contacts(written_run):
    """A run of a pair of cubes, whose contact and what the detector ``it`` reports follow planted letters, one a frame.

    Tables have first frame and number of frames of each miss and false contact; ``missed_by`` names the detector in the
    row of each contact that it missed whole.
    """
    rows, expected = written_run.rows, written_run.expected
    assert [(row["episode"], row["first"], row["frames"]) for row in rows["misses"]] == expected.misses
    assert [(row["first"], row["frames"]) for row in rows["false"]] == expected.false_contacts
    assert sum(row["missed_by"] == "it" for row in rows["episodes"]) == expected.contacts_missed


def test_files_and_json_have_the_rows_of_the_tables(written_run):
    """The tables of a run have a Parquet file each; JSON has misses and false contacts of the detector ``it``."""
    rows, result = written_run.rows, written_run.result
    for name, table in result.tables.items():
        assert pq.read_table(written_run.folder / f"{name}.parquet").select(table.head).to_pylist() == rows[name]
    assert [run_json(result)[name]["it"] for name in ("misses", "false")] == [rows["misses"], rows["false"]]


def test_summary_counts_planted_contacts(written_run):
    """Contact of a pair of cubes, and what the detector ``it`` reports, follow planted letters, one a frame.

    ``summary.json`` has the counts that are made of these by hand.
    """
    audit = json.loads((written_run.folder / "summary.json").read_text())["audit"]["it"]
    expected = written_run.expected
    for name in ("contacts", "contacts_missed", "late_or_cut_short", "contacts_undecided"):
        assert audit[name] == getattr(expected, name), name
    assert audit["misses"] == len(expected.misses)
    assert audit["false_contacts"] == len(expected.false_contacts)
    frames = audit["pair_frames"]
    expected_frames = [expected.frames[word] for word in ("both", "MISSED", "false")]
    assert [frames[name] for name in ("both", "missed", "false_contact")] == expected_frames


def test_rankings_count_planted_contacts(written_run):
    """Contact of a pair of cubes, and what the detector ``it`` reports, follow planted letters, one a frame.

    Its row in the ranking has contacts missed, late or cut short and, where there are any, undecided; the terminal
    (first screen and tables) and the page have all, the notebook the first two.
    """
    expected = written_run.expected
    counts = [expected.contacts_missed, expected.late_or_cut_short]
    if expected.contacts_undecided:
        counts.append(expected.contacts_undecided)
    ranked = [str(count) for count in counts]
    for text in (written_run.tables, written_run.screen):
        line = next(line for line in text.splitlines() if line.startswith("it "))
        _label, _what, *cells = re.split(r"\s{2,}", line)
        assert cells[: len(ranked)] == ranked
    columns = "missed|late or cut short|undecided"
    assert re.findall(rf'"n(?: bad)?" data-l="(?:{columns})">(\d+)<', written_run.page) == ranked
    (_label, missed_cell, late_cell, *_), *_ = split_lines(written_run.notebook, "it ")
    assert [missed_cell, late_cell] == ranked[:2]


def test_headline_is_the_same_sentence_in_every_output(written_run):
    """The headline of a run in five outputs, without tags of the page and line ends."""
    run = written_run
    for text in (run.screen, run.page, run.picture, run.markdown, run.notebook):
        assert run.headline in " ".join(unescape(re.sub("<[^>]*>", "", text)).split())


def test_pair_table_and_frame_counts_equal_planted_counts(written_run):
    """The only pair, a-b, has a row where it touched or was said to: contacts, missed, late, and frames by outcome.

    Frames by outcome have a line each in the terminal, and a row in the picture.
    """
    expected, tables = written_run.expected, written_run.tables
    both_missed_false = [expected.frames[word] for word in ("both", "MISSED", "false")]
    counts = [expected.contacts, expected.contacts_missed, expected.late_or_cut_short, *both_missed_false]
    has_row = expected.contacts > 0 or any(both_missed_false)
    assert split_lines(tables, "a-b ") == ([["a-b", *map(str, counts)]] if has_row else [])
    lines = [line.strip().rsplit(maxsplit=1) for line in tables.splitlines() if line.strip()]
    for word, count in expected.frames.items():
        assert [word.lower(), str(count)] in lines
    assert f"| pair-frames | {' | '.join(map(str, expected.frames.values()))} |" in written_run.picture


def test_lists_of_faults_number_misses_and_false_contacts(written_run):
    """The terminal lists (number, frames) of 20 misses at most and counts the others, then false contacts by gap.

    The page has an anchor for each fault, miss-1 and so on, and the picture a line.
    """
    rows, tables = written_run.rows, written_run.tables
    widest_first = sorted(rows["false"], key=lambda row: -(row["gap"] or 0.0))
    listed = re.findall(r"^ *(\d+) +[\d.]+ +a - b +(\d+) ", tables, re.MULTILINE)
    expected_list = [*rows["misses"][:MOST_LISTED], *widest_first]
    assert listed == [(str(row["number"]), str(row["frames"])) for row in expected_list]
    not_listed = len(written_run.expected.misses) - MOST_LISTED
    assert (f"… and {not_listed} more: see misses.parquet" in tables) == (not_listed > 0)
    misses = [("miss", str(row["number"])) for row in rows["misses"]]
    false_contacts = [("false", str(row["number"])) for row in rows["false"]]
    faults = sorted(misses + false_contacts)
    assert sorted(re.findall(r' id="(miss|false)-(\d+)(?:-it)?"', written_run.page)) == faults
    kinds_of_miss = "missed|late|short|interrupted"
    in_picture = set(re.findall(rf"^ *[\d.]+ s +it +({kinds_of_miss}|false) (\d+) ", written_run.picture, re.MULTILINE))
    assert sorted(("false" if kind == "false" else "miss", number) for kind, number in in_picture) == faults


def called_functions(action):
    """File of the tool -> how often each of its functions is called meanwhile; a quantile of numpy counts as one."""
    calls = {}

    def count_call(frame, event, _):
        if event != "call":
            return
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        counts = file.startswith(TOOL)
        if not counts and name in ("quantile", "percentile"):
            # A picture is framed in still.py, and nothing counted.
            counts = not (frame.f_back and frame.f_back.f_code.co_filename.endswith("still.py"))
        if counts:
            calls.setdefault(file, Counter())[name] += 1

    sys.setprofile(count_call)
    try:
        action()
    finally:
        sys.setprofile(None)
    return calls


RENDER_MISS = {
    "terminal": lambda result: terminal_text(stacked(*section_of(result, SectionName.FAULTS).tables)),
    "Parquet": lambda result: with_keys(result.tables["misses"].to_arrow(), result),
    "page": lambda result: cards(view_of(result), "it"),
    "picture": lambda result: log_moment_lists(
        RecordingWriter(rr.RecordingStream("walk"), RecordingClock.of(result.assembly)), result, key_moments(result)
    ),
}
"""Output -> what makes its list of misses."""


@pytest.mark.parametrize("output", RENDER_MISS)
def test_a_miss_is_rendered_through_at_most_thirteen_files(output):
    """Who changes how a miss is displayed must read few files, 13 at most: those whose functions are called.

    The run has a single miss. It is rendered twice, so that templates and the like are in memory the second time. More
    than two files show that calls were noticed.
    """
    result = run("one")
    RENDER_MISS[output](result)
    files = called_functions(lambda: RENDER_MISS[output](result))
    assert 2 < len(files) <= 13, sorted(files)


ONCE = ("ranking", "answers_of_run", "examine", "pair_records", "result_tables", "document_of_run")
OF_EACH = ("episodes", "sample_times")
OF_AUDITED = ("audit_of_detector", "false_contacts", "match_episodes", "count_contacts", "count_reports")


@pytest.fixture(scope="module")
def counted_run():
    """A run of three detectors, of which the reference (exact) judges two, and how often functions were called in it.

    Two cubes touch for a frame, and twice are over 0.5 m deep in each other, the last time until the end.
    """
    session = unit_cubes_on_x({"a": [0.0] * 12, "b": [3, 0.9, 3, 3, 3, 0.4, 0.4, 3, 3, 3, 0.4, 0.4]})
    results = []
    calls = called_functions(lambda: results.append(replay.run(session, detectors="hybrid,slow=discrete,exact")))
    (result,) = results
    return SimpleNamespace(result=result, calls=sum(calls.values(), Counter()))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("functions", "times"),
    [
        pytest.param(ONCE, 1, id="once a run"),
        pytest.param(OF_EACH, 3, id="once for each of 3 detectors"),
        pytest.param(OF_AUDITED, 2, id="once for each of 2 audited detectors"),
    ],
)
def test_each_fact_of_a_run_is_computed_once(functions, times, counted_run):
    """A run of three detectors, two of which are compared with the third; calls are counted by name of function."""
    assert {name: counted_run.calls[name] for name in functions} == dict.fromkeys(functions, times)


@pytest.mark.slow
def test_outputs_compute_nothing(counted_run, tmp_path):
    """Terminal, Markdown, JSON, notebook, page and folder call none of the functions that compute facts of a run.

    Properties of the same names in ``show``, which only pass a fact on, are left out.
    """
    result = counted_run.result

    def make_all_outputs():
        terminal_text(run_tables(result), run_screen(result))
        run_markdown(result, ())
        run_json(result)
        repr(result)
        report_html(result)
        write_run_folder(result, tmp_path / "run", picture=True)

    calls_of_file = called_functions(make_all_outputs)
    calls = sum((counts for file, counts in calls_of_file.items() if "/show/" not in file), Counter())
    assert calls
    computing = {*ONCE, *OF_EACH, *OF_AUDITED, "counts_over_offsets", "why_missed", "why_false", "quantile"}
    assert {name for name in computing if calls[name]} == set()
