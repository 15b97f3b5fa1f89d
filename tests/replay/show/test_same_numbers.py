"""Every number that stands on two screens is the same on both, and is the one that ``summary.json`` holds."""

import json
import re
from html import unescape
from io import StringIO

import pytest
from rich.console import Console
from support.report_states import RUN_OF_STATE, SCREENS, result_of
from support.viewers import recording_text

import replay
from replay import words
from replay.advice.scoring import Scoring
from replay.advice.settings import settings_of
from replay.cli.run_markdown import run_markdown
from replay.cli.run_tables import run_screen
from replay.document.cost import busy_sentence
from replay.document.ranking import ranks_with_fixes
from replay.prepare.frame_times import frame_rate
from replay.show.accuracy import run_dots
from replay.show.rerun_log import documents
from replay.show.results.run_folder import write_run_folder

FIRST_COUNT = {"terminal": 2, "Markdown": 2, "picture": 1, "notebook": 1}
"""Position of the first count in a line of the ranking of each screen."""

COLUMNS = ("missed", "late or cut short", "false contact", "mean ms", "p99 ms")


QUICK_SCREENS = ("several", "undecided", "busy")
"""States that differ most: contacts missed and late, contacts undecided, and times of a busy machine."""


@pytest.fixture(
    scope="module",
    params=[pytest.param(state, marks=() if state in QUICK_SCREENS else pytest.mark.slow) for state in SCREENS],
)
def screens(request, tmp_path_factory):
    """A run, its summary as written, and the text of each screen."""
    result = result_of(request.param)
    folder = tmp_path_factory.mktemp("run") / "run"
    write_run_folder(result, folder, picture=True)
    console = Console(width=200, file=StringIO())
    console.print(run_screen(result))
    texts = {
        "terminal": console.file.getvalue(),
        "Markdown": run_markdown(result, ()),
        "report": unescape((folder / "report.html").read_text(encoding="utf-8")),
        "picture": recording_text(folder / "run.rrd"),
        "notebook": repr(replay.RunResult.of(result)),
    }
    return result, json.loads((folder / "summary.json").read_text()), texts, folder


def cells_of(summary, label):
    """Cells of a detector in every ranking, from the numbers of the summary alone."""
    audit, seconds = summary["audit"].get(label), summary["detectors"][label]["seconds"]
    mean, p99 = seconds["per_frame_mean"], seconds["sample_times"]["p99"]
    times = [words.milliseconds(mean), words.milliseconds(p99)]
    if summary["detectors"][label]["name"] == "recorded":
        times = ["not measured"] * 2
    if audit is None:
        return ["reference", "-", "-", *times]
    ranges = [audit["counts_over_offsets"][name] for name in ("contacts_missed", "late_or_cut_short")]
    counts = [words.count_range((round(item["smallest"]), round(item["largest"]))) for item in ranges]
    false = audit.get("means_over_offsets", audit)["false_contact"]["value"]
    return [*counts, "0 %" if false is None else words.as_percentage(false), *times]


def loss_of(audit):
    """The loss by its definition in the glossary, from the numbers of the summary alone."""
    over = audit.get("means_over_offsets")
    missed = over["contacts_missed"]["value"] if over else audit["contacts_missed"] / max(1, audit["contacts"])
    false, time = ((over or audit)[name]["value"] or 0.0 for name in ("false_contact", "time_missed"))
    return (missed or 0.0) + audit["contacts_undecided"] / max(1, audit["contacts"]) + time + false


def rows_of(text, label):
    """Cells of each line that begins with a label, in the ranking and not in the tables below it."""
    ranking, *_ = re.split("<details>|\n## Time of each detector", text)
    lines = [line.strip(" |") for line in ranking.splitlines()]
    cells = [re.split(r"\s*\|\s*|\s{2,}", line) for line in lines]
    return [row for row in cells if row[0].split(":")[0] == label and len(row) > len(COLUMNS)]


def test_a_ranking_has_the_same_cells_on_every_screen(screens):
    """Expected cells are made from summary.json."""
    result, summary, texts, _ = screens
    pages = texts | {"picture": documents.answer_text(result)}
    printed = set()
    for label in (*summary["audit"], summary["oracle"]):
        expected = cells_of(summary, label)
        for name in FIRST_COUNT:
            for row in rows_of(pages[name], label):
                printed.add(name)
                missed, late, *rest = row[FIRST_COUNT[name] :]
                assert [missed, late] == expected[:2], (name, row)
                assert (rest[:3] if name == "Markdown" else rest[-3:]) == expected[2:], (name, row)
        row = re.search(rf"<th[^>]*>(?:(?!</tr>).)*?\b{re.escape(label)}\b.*?</tr>", texts["report"], re.DOTALL)[0]
        cells = re.findall(r'data-l="(?:missed|late or cut short|false contact|mean ms|p99 ms)">([^<]*)<', row)
        assert cells == (expected if label in summary["audit"] else expected[-len(cells) :])
    # One detector alone needs no table in Markdown and picture.
    several = {"Markdown", "picture"} if len(summary["audit"]) > 1 else set()
    assert printed == {"terminal", "notebook"} | several
    assert all(line in texts["picture"] for line in pages["picture"].splitlines())


def test_loss_is_the_same_in_tables_and_plots(screens):
    """The expected loss is made of the numbers of summary.json.

    Names of dots that lie on each other find no room, so that a plot may lack some.
    """
    result, summary, texts, _ = screens
    losses = {label: loss_of(audit) for label, audit in summary["audit"].items()} | {summary["oracle"]: 0.0}
    assert {rank.label: rank.loss for rank in result.ranking} == pytest.approx(losses)
    for label, loss in losses.items():
        assert all(words.loss_number(loss) in row for row in rows_of(texts["Markdown"], label))
    dots = {dot.name for dot in run_dots(result)}
    rows = {rank.label: rank.loss for rank in ranks_with_fixes(result.ranking, result.document)}
    assert dots <= {f"{label}: {words.loss_number(loss)}" for label, loss in rows.items()}
    fixed = {label for label in rows if label == "fix"}
    assert all(any(dot.startswith(label) for dot in dots) for label in fixed)
    assert {dot.name for dot, _ in documents.dots_of(result)} == dots
    for label, loss in losses.items():
        for name in ("report", "picture"):
            written = re.findall(rf">{re.escape(label)}: ([\d.]+)<", texts[name])
            assert set(written) <= {words.loss_number(loss)}, name


def test_a_busy_machine_is_named_on_every_screen(screens):
    """Busy by the fraction of the processor that detectors lacked, of summary.json; else no screen names it."""
    _, summary, texts, _ = screens
    fractions = [1.0 - figures["seconds"].get("processor_fraction", 1.0) for figures in summary["detectors"].values()]
    sentence = busy_sentence(max(fractions))
    for name in ("terminal", "Markdown", "report", "picture"):
        written = "The machine was busy" in " ".join(texts[name].split())
        assert written == bool(sentence), name


def test_recording_rate_is_the_same_in_fix_and_report(screens):
    """One over the median step of summary.json; a fix that samples every frame names it."""
    result, summary, texts, _ = screens
    rate = frame_rate(result.assembly.motion.times)
    assert summary["session"]["median_step"] == pytest.approx(1.0 / rate)
    assert f", {words.rate(rate)}, " in texts["report"]
    fixes = [fix for answer in result.answers if (fix := answer.fix) and fix.text.startswith("Sample every frame")]
    assert all(f"({words.rate(rate)})" in fix.text for fix in fixes)


@pytest.mark.parametrize("state", ["several", pytest.param("nine pairs", marks=pytest.mark.slow)])
def test_tradeoff_and_ranking_have_the_same_counts(state):
    """A tradeoff scores the detections of a run again; the last rank is the reference."""
    result = RUN_OF_STATE[state]()
    scoring = Scoring(
        result.assembly,
        replay.detection.detector_spec.parse_detector("exact"),
        seed=0,
        tau=2e-6,
        session=result.session,
    )
    assert len(result.ranking) > 1
    for rank in result.ranking[:-1]:
        (setting,) = settings_of(f"{rank.label}={rank.setting}")
        row = scoring.figures(result.detections[rank.label], setting)
        assert row["loss"] == pytest.approx(rank.loss)
        assert (row["missed_smallest"], row["missed_largest"]) == rank.missed_counts
        assert (row["late_smallest"], row["late_largest"]) == rank.late_counts
        assert row["false"] == rank.false.value
