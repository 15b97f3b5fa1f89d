"""One result, one set of numbers: of letters, tables and every output the same, each computed once."""

import json
import os
import re
import sys
from collections import Counter
from html import unescape
from io import StringIO
from pathlib import Path

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

COUNTED = ("both", "MISSED", "false", "within tolerance", "left out")
TOOL = f"{Path(replay.__file__).parent}{os.sep}"


def terminal_text(*displayed):
    """Text of these pieces on a wide terminal."""
    console = Console(width=200, file=StringIO())
    for piece in displayed:
        console.print(piece)
    return console.file.getvalue()


def blocks(text, mark):
    """The words of each line that begins with a mark."""
    return [line.split() for line in text.splitlines() if line.startswith(mark)]


QUICK_STATES = ("several", "undecided", "false at both ends", "more than a list holds")
"""Of all: late and missed contacts, undecided frames, false ones on both sides of a contact, and a cut list."""


@pytest.mark.parametrize(
    "state", [pytest.param(state, marks=() if state in QUICK_STATES else pytest.mark.slow) for state in STATES]
)
def test_every_output_of_a_run_has_the_same_numbers(state, tmp_path):
    """Counted by hand from letters a frame, of reference (``truth``) and detector (``output``), one pair a and b.

    Then looked up in tables, files, terminal, page, notebook and picture.
    """
    (truth, output, headline), result = STATES[state], run(state)
    write_run_folder(result, tmp_path / "run", picture=True)
    page, picture = ((tmp_path / "run" / name) for name in ("report.html", "run.rrd"))
    page, picture = page.read_text(encoding="utf-8"), recording_text(picture)
    outcome, (contacts, lost) = outcomes(truth, output), missed(truth, output)
    wrong = [(first, count) for first, count, word in runs_of(outcome) if word == "false"]
    ends = [set(outcome[first : first + count]) for first, count, letter in runs_of(truth) if letter == "C"]
    whole, late, open_ = (ends.count(sentence) for sentence in ({"MISSED"}, {"MISSED", "both"}, {"left out"}))
    counts = [outcome.count(word) for word in COUNTED]

    # Tables and files.
    rows = {name: table.plain() for name, table in result.tables.items()}
    assert [(row["episode"], row["first"], row["frames"]) for row in rows["misses"]] == lost
    assert [(row["first"], row["frames"]) for row in rows["false"]] == wrong
    assert sum(row["missed_by"] == "it" for row in rows["episodes"]) == whole
    for name, table in result.tables.items():
        assert pq.read_table(tmp_path / "run" / f"{name}.parquet").select(table.head).to_pylist() == rows[name]
    assert [run_json(result)[name]["it"] for name in ("misses", "false")] == [rows["misses"], rows["false"]]
    audit = json.loads((tmp_path / "run" / "summary.json").read_text())["audit"]["it"]
    names = ("contacts", "contacts_missed", "late_or_cut_short", "contacts_undecided", "misses", "false_contacts")
    assert [audit[name] for name in names] == [contacts, whole, late, open_, len(lost), len(wrong)]
    assert list(audit["pair_frames"].values())[1:4] == counts[:3]

    # The ranking: contacts missed, late, and undecided where there are any.
    ranked = [str(count) for count in (whole, late, *([open_] if open_ else []))]
    tables, screen = terminal_text(run_tables(result)), terminal_text(run_screen(result))
    for text in (tables, screen):
        assert re.split(r"\s{2,}", next(line for line in text.splitlines() if line.startswith("it ")))[2:][
            : len(ranked)
        ] == (ranked)
    assert re.findall(r'"n(?: bad)?" data-l="(?:missed|late or cut short|undecided)">(\d+)<', page) == ranked
    prompt = repr(replay.RunResult.of(result))
    assert blocks(prompt, "it ")[0][1:3] == ranked[:2]
    for text in (screen, page, picture, run_markdown(result, ()), prompt):
        assert headline in " ".join(unescape(re.sub("<[^>]*>", "", text)).split())

    # The table of pairs, and the lists of faults by number.
    of_pair = [["a-b", *map(str, (contacts, whole, late, *counts[:3]))]] if contacts or any(counts[:3]) else []
    assert blocks(tables, "a-b ") == of_pair
    listed = re.findall(r"^ *(\d+) +[\d.]+ +a - b +(\d+) ", tables, re.MULTILINE)
    widest = [
        (str(row["number"]), str(row["frames"])) for row in sorted(rows["false"], key=lambda row: -(row["gap"] or 0.0))
    ]
    assert listed == [(str(row["number"]), str(row["frames"])) for row in rows["misses"][:20]] + widest
    assert (f"… and {len(lost) - 20} more: see misses.parquet" in tables) == (len(lost) > 20)
    faults = [("miss", str(row["number"])) for row in rows["misses"]] + [("false", name) for name, _ in widest]
    assert sorted(re.findall(r' id="(miss|false)-(\d+)(?:-it)?"', page)) == sorted(faults)
    names = "missed|late|short|interrupted|false"
    in_list = {*re.findall(rf"^ *[\d.]+ s +it +({names}) (\d+) ", picture, re.MULTILINE)}
    assert sorted(("false" if name == "false" else "miss", number) for name, number in in_list) == sorted(faults)
    assert f"| pair-frames | {' | '.join(map(str, counts))} |" in picture
    for word, count in zip(COUNTED, counts, strict=True):
        assert [word.lower(), str(count)] in [
            line.rsplit(maxsplit=1) for line in map(str.strip, tables.splitlines()) if line
        ]


def entered(action):
    """File of the tool -> names of its functions that are called meanwhile; a quantile of numpy counts as one."""
    result = {}

    def tell(frame, event, _):
        if event != "call":
            return
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        counts = file.startswith(TOOL)
        if not counts and name in ("quantile", "percentile"):
            # A picture is framed in still.py, and nothing counted.
            counts = not (frame.f_back and frame.f_back.f_code.co_filename.endswith("still.py"))
        if counts:
            result.setdefault(file, Counter())[name] += 1

    sys.setprofile(tell)
    try:
        action()
    finally:
        sys.setprofile(None)
    return result


WALKS = {
    "terminal": lambda result: terminal_text(stacked(*section_of(result, SectionName.FAULTS).tables)),
    "Parquet": lambda result: with_keys(result.tables["misses"].to_arrow(), result),
    "page": lambda result: cards(view_of(result), "it"),
    "picture": lambda result: log_moment_lists(
        RecordingWriter(rr.RecordingStream("walk"), RecordingClock.of(result.assembly)), result, key_moments(result)
    ),
}


@pytest.mark.parametrize("output", WALKS)
def test_a_miss_is_rendered_through_at_most_thirteen_files(output):
    """Files of the product whose functions are called, once templates and the like are in memory."""
    WALKS[output](run("one"))
    files = entered(lambda: WALKS[output](run("one")))
    assert 2 < len(files) <= 13, sorted(files)


ONCE = ("ranking", "answers_of_run", "examine", "pair_records", "result_tables", "document_of_run")
OF_EACH = ("episodes", "sample_times")
OF_AUDITED = ("audit_of_detector", "false_contacts", "match_episodes", "count_contacts", "count_reports")


@pytest.mark.slow
def test_facts_are_computed_once_and_outputs_compute_nothing(tmp_path):
    """Calls are counted by name: once a run, once for each of 3 detectors, or of 2 that are audited.

    A contact is in one frame; two are over 0.5 m deep, of which one is cut by the end.
    """
    session = unit_cubes_on_x({"a": [0.0] * 12, "b": [3, 0.9, 3, 3, 3, 0.4, 0.4, 3, 3, 3, 0.4, 0.4]})
    made = []
    matches = entered(lambda: made.append(replay.run(session, detectors="hybrid,slow=discrete,exact")))
    counts = sum(matches.values(), Counter())
    for names, times in ((ONCE, 1), (OF_EACH, 3), (OF_AUDITED, 2)):
        assert {name: counts[name] for name in names} == dict.fromkeys(names, times)
    (result,) = made

    def all_outputs():
        terminal_text(run_tables(result), run_screen(result))
        run_markdown(result, ())
        run_json(result)
        repr(result)
        report_html(result)
        write_run_folder(result, tmp_path / "run", picture=True)

    # An output has properties of the same names that pass on.
    requested = sum((names for file, names in entered(all_outputs).items() if "/show/" not in file), Counter())
    computed = {*ONCE, *OF_EACH, *OF_AUDITED, "counts_over_offsets", "why_missed", "why_false", "quantile"}
    assert {name for name in computed if requested[name]} == set()
