"""Every number that stands on two screens is the same on both, and is the one that ``summary.json`` holds."""

import json
import re
from html import unescape
from io import StringIO
from types import SimpleNamespace

import pytest
from rich.console import Console
from support.report_states import RUN_OF_STATE, SCREENS

import replay
from replay import words
from replay.advice.scoring import Scoring
from replay.advice.settings import settings_of
from replay.cli.run_markdown import run_markdown
from replay.cli.run_tables import run_screen
from replay.detection.detector_spec import parse_detector
from replay.document.cost import busy_sentence
from replay.document.ranking import ranks_with_fixes
from replay.prepare.frame_times import frame_rate
from replay.show.accuracy import run_dots
from replay.show.rerun_log import documents

FIRST_COUNT = {"terminal": 2, "Markdown": 2, "picture": 1, "notebook": 1}
"""Output -> position of the first count in a line of its ranking, which begins with label and, in some, what it is."""

COLUMNS = ("missed", "late or cut short", "false contact", "mean ms", "p99 ms")


QUICK_SCREENS = ("several", "undecided", "busy")
"""States that differ most: contacts missed and late, contacts undecided, and times of a busy machine."""


@pytest.fixture(
    scope="module",
    params=[pytest.param(state, marks=() if state in QUICK_SCREENS else pytest.mark.slow) for state in SCREENS],
)
def screens(request, written_run_of):
    """A run, its ``summary.json`` as read back, and the text of each of its screens; a run a state."""
    run = written_run_of(request.param)
    result, folder = run.result, run.folder
    console = Console(width=200, file=StringIO())
    console.print(run_screen(result))
    texts = {
        "terminal": console.file.getvalue(),
        "Markdown": run_markdown(result, ()),
        "report": unescape((folder / "report.html").read_text(encoding="utf-8")),
        "picture": run.picture_text,
        "notebook": repr(replay.RunResult.of(result)),
    }
    return SimpleNamespace(result=result, summary=json.loads((folder / "summary.json").read_text()), texts=texts)


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


def test_a_ranking_has_the_same_cells_in_every_text(screens):
    """The row of each detector: missed, late or cut short, false contact, mean and p99 ms, made from summary.json.

    Markdown and picture leave the ranking out where a single detector is compared with the reference.
    """
    summary = screens.summary
    texts = screens.texts | {"picture": documents.answer_text(screens.result)}
    outputs_with_rows = set()
    for label in (*summary["audit"], summary["oracle"]):
        missed_and_late, false_and_times = cells_of(summary, label)[:2], cells_of(summary, label)[2:]
        for output, first_count in FIRST_COUNT.items():
            for row in rows_of(texts[output], label):
                outputs_with_rows.add(output)
                missed, late, *others = row[first_count:]
                # Further columns stand behind these in Markdown, and between in others.
                last_three = others[:3] if output == "Markdown" else others[-3:]
                assert [missed, late] == missed_and_late, (output, row)
                assert last_three == false_and_times, (output, row)
    outputs_of_several = {"Markdown", "picture"} if len(summary["audit"]) > 1 else set()
    assert outputs_with_rows == {"terminal", "notebook"} | outputs_of_several


def test_ranking_of_the_report_has_the_cells_of_the_summary(screens):
    """Cells of a page name their column (``data-l``); those of the reference are its times alone."""
    summary = screens.summary
    for label in (*summary["audit"], summary["oracle"]):
        row = re.search(
            rf"<th[^>]*>(?:(?!</tr>).)*?\b{re.escape(label)}\b.*?</tr>", screens.texts["report"], re.DOTALL
        )[0]
        cells = re.findall(rf'data-l="(?:{"|".join(COLUMNS)})">([^<]*)<', row)
        expected = cells_of(summary, label)
        assert cells
        assert cells == (expected if label in summary["audit"] else expected[-len(cells) :])


def test_picture_holds_every_line_of_its_answer(screens):
    """The text beside the picture is made in memory, and read back from the file of the picture."""
    lines = documents.answer_text(screens.result).splitlines()
    assert lines
    assert [line for line in lines if line not in screens.texts["picture"]] == []


def test_loss_of_the_ranking_is_that_of_the_summary(screens):
    """The loss of each detector by its definition, from numbers of summary.json; that of the reference is 0.

    Markdown prints it in the row of the detector.
    """
    result, summary = screens.result, screens.summary
    losses = {label: loss_of(audit) for label, audit in summary["audit"].items()} | {summary["oracle"]: 0.0}
    assert {rank.label: rank.loss for rank in result.ranking} == pytest.approx(losses)
    for label, loss in losses.items():
        for row in rows_of(screens.texts["Markdown"], label):
            assert words.loss_number(loss) in row


def test_dots_of_plots_are_named_by_label_and_loss(screens):
    """Dots of report and picture are named "label: loss", with the loss of the ranking; the measured fix has a dot too.

    Names of dots that lie on each other find no room, so that a plot may lack some.
    """
    result = screens.result
    ranks = ranks_with_fixes(result.ranking, result.document)
    name_of_label = {rank.label: f"{rank.label}: {words.loss_number(rank.loss)}" for rank in ranks}
    dots = {dot.name for dot in run_dots(result)}
    assert dots <= set(name_of_label.values())
    assert {dot.name for dot, _ in documents.dots_of(result)} == dots
    if "fix" in name_of_label:
        assert name_of_label["fix"] in dots
    for label, name in name_of_label.items():
        for output in ("report", "picture"):
            written = re.findall(rf">({re.escape(label)}: [\d.]+)<", screens.texts[output])
            assert set(written) <= {name}, output


def test_a_busy_machine_is_named_on_every_screen(screens):
    """Detectors lacked a fraction of the processor, by summary.json: where it is large, every screen says so.

    The largest fraction decides, by the limit of the product; below it, no screen does.
    """
    seconds = [detector["seconds"] for detector in screens.summary["detectors"].values()]
    is_busy = bool(busy_sentence(max(1.0 - times.get("processor_fraction", 1.0) for times in seconds)))
    for output in ("terminal", "Markdown", "report", "picture"):
        text = " ".join(screens.texts[output].split())
        assert ("The machine was busy" in text) == is_busy, output


def test_recording_rate_is_the_same_in_fix_and_report(screens):
    """The rate of a recording is one over the median step of its frames, which summary.json has.

    The report names it beside the session, and a fix "Sample every frame" in brackets.
    """
    result = screens.result
    rate = 1.0 / screens.summary["session"]["median_step"]
    assert frame_rate(result.assembly.motion.times) == pytest.approx(rate)
    assert f", {words.rate(rate)}, " in screens.texts["report"]
    fixes = [answer.fix.text for answer in result.answers if answer.fix]
    every_frame_fixes = [text for text in fixes if text.startswith("Sample every frame")]
    assert all(f"({words.rate(rate)})" in text for text in every_frame_fixes)


@pytest.mark.parametrize("state", ["several", pytest.param("nine pairs", marks=pytest.mark.slow)])
def test_tradeoff_and_ranking_have_the_same_counts(state):
    """The command ``tradeoff`` counts faults of a setting by ``Scoring``; a run has them in its ranking.

    Here it scores what the detectors of a run reported: the same loss, counts over the sampling offsets, and false
    contact. The last rank is the reference, which has none. ``tau``: 2 um, below which nothing is called wrong.
    """
    result = RUN_OF_STATE[state]()
    scoring = Scoring(result.assembly, parse_detector("exact"), seed=0, tau=2e-6, session=result.session)
    *ranks, _reference = result.ranking
    assert ranks
    for rank in ranks:
        (setting,) = settings_of(f"{rank.label}={rank.setting}")
        row = scoring.figures(result.detections[rank.label], setting)
        assert row["loss"] == pytest.approx(rank.loss)
        assert (row["missed_smallest"], row["missed_largest"]) == rank.missed_counts
        assert (row["late_smallest"], row["late_largest"]) == rank.late_counts
        assert row["false"] == rank.false.value
