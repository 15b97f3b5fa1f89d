"""Texts of the picture: the answer, what accuracy costs, and what was replayed. The figures are those of the run."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from replay.base.constants import CAVEAT
from replay.base.shown import plural
from replay.base.tables import Column, Table, markdown, table
from replay.comparison.misses import MANY
from replay.effects.effect_summary import happened_words
from replay.outputs.palette import Rgba
from replay.outputs.plots import Dot
from replay.outputs.rerun_log.recording_file import entity
from replay.outputs.rerun_log.timing import colour_of, stage_ms
from replay.outputs.run_tables import FALSE_CONTACT, LATE_OR_SHORT, RANKING, sampling_notes
from replay.outputs.words import FRAME_ROWS, NOT_LOOKED_FOR, OUTCOME_WORDS
from replay.pipeline.answer import Answer, milliseconds
from replay.pipeline.headline import doubts, price, undecided
from replay.pipeline.ranking import part_of
from replay.pipeline.run_result import RunResult

ANSWER: Final = "answer"
ACCURACY: Final = "accuracy/text"
SESSION_TEXT: Final = "session"

NO_BREAK: Final = "\u00a0"
"""A space at which no line is broken: between a number and its unit."""

HEADS: Final = {LATE_OR_SHORT: LATE_OR_SHORT, FALSE_CONTACT: "false", "mean ms": "ms", "p99 ms": "p99"}
"""Short heads: at 1,280 pixels all columns fit."""


def details_path(label: str) -> str:
    """Entity of the text about one detector."""
    return entity("details", label)


def answer_text(result: RunResult) -> str:
    """What is wrong, why, what mends it, what being right costs, and the ranking, the worst first."""
    answer = result.answers[0]
    parts = [*doubts(result), _heading(answer.sentence), *_reasons(answer), f"**Cost** {' '.join(price(result))}"]
    if len(result.ranking) > 2:
        parts.append(ranking_text(result))
    if answer.moment is not None:
        parts.append(_moment_words(result, answer))
    parts += [*undecided(result), *sampling_notes(result), f"*{replayed(result)} {CAVEAT}*"]
    return "\n\n".join(parts)


def _heading(sentence: str) -> str:
    return f"# {sentence.removesuffix('.').replace(' %', NO_BREAK + '%')}"


def _reasons(answer: Answer) -> list[str]:
    """Why, and what mends it."""
    rows = [(f"**{name}** {words}", command) for name, words, command in answer.reasons]
    return [f"{words} `{command}`" if command else words for words, command in rows]


def ranking_text(result: RunResult) -> str:
    """Every detector in Markdown: its name and what it is in one column, so that all fit beside a picture."""
    contacts = plural(result.ranking[-1].contacts, "contact")
    named = Column(contacts, of=lambda rank: f"{rank.label}:{NO_BREAK}{rank.what}")
    names = ["missed", *HEADS]
    if any(rank.undecided for rank in result.ranking):
        names.append("undecided")
    columns = (replace(column, name=HEADS.get(column.name, column.name)) for column in RANKING if column.name in names)
    return markdown(Table.of([named, *columns], result.ranking))


def _moment_words(result: RunResult, answer: Answer) -> str:
    """When the close-up is, what it shows, and the command that leads there."""
    moment, label = answer.moment, answer.label
    assert moment is not None
    what, faults = ("miss", result.misses) if moment.kind == "miss" else ("false contact", result.false)
    which = f"{what} {moment.number} of {len(faults[label])} of {label}: {' and '.join(moment.pair)}"
    return f"**Close-up** at {moment.seconds:.3f} s, {which}. `replay view RUN {moment.option} --by {label}`"


def accuracy_text(result: RunResult) -> str:
    """What missing nothing costs, and what each detector does for its price."""
    cost, *notes = price(result)
    if result.tradeoff is None:
        lines = [_heading(f"To miss nothing: {cost}")]
    else:
        lines = [_heading(result.tradeoff.answer), *(f"- {sentence}" for sentence in result.tradeoff.advice[1:])]
        if result.tradeoff.cut:
            lines.append(f"Not tried, for want of time: {', '.join(result.tradeoff.cut)}.")
    lines += [f"- {answer.sentence}" for answer in result.answers]
    return "\n\n".join([*lines, f"*{' '.join(notes)}*"])


def dots_of(result: RunResult) -> list[tuple[Dot, float, Rgba]]:
    """A dot a detector, or a setting on the front, whose time was measured, its false share of the time, its colour."""
    labels, dots = [*result.detections], []
    if result.tradeoff is not None and result.tradeoff.front:
        rows = {row["label"]: row for row in result.tradeoff.rows}
        for number, label in enumerate(result.tradeoff.front):
            row = rows[label]
            dots.append((label, row["mean_ms"], row["missed"] + row["late"], row["false"] or 0.0, colour_of(number)))
    else:
        for rank in result.ranking:
            if rank.mean is not None:
                wrong = (part_of(rank.missed) + part_of(rank.in_part)) * rank.contacts
                colour = colour_of(labels.index(rank.label))
                dots.append((rank.label, 1e3 * rank.mean, wrong, part_of(rank.false), colour))
    return [(Dot(f"{name}: {round(wrong, 1):g}", ms, wrong), false, colour) for name, ms, wrong, false, colour in dots]


def series_names(result: RunResult) -> dict[str, str]:
    """Label -> what a legend says of its times."""
    names = {}
    for label, figures in result.summary["detectors"].items():
        seconds, frame = figures["seconds"], figures["seconds"].get("per_frame")
        slow = f", p99 {milliseconds(frame['p99'])}, longest {1e3 * frame['max']:.3g}" if frame else ""
        names[label] = f"{label}: mean {milliseconds(seconds['per_frame_mean'])}{slow}"
    return names


def replayed(result: RunResult) -> str:
    """How much was replayed, in a sentence."""
    times, assembly = result.assembly.motion.times, result.assembly
    span = float(times[-1] - times[0]) if len(times) else 0.0
    return f"{span:.1f} s, {len(times):,} frames, {len(assembly.bodies)} bodies, {plural(len(assembly.pairs), 'pair')}."


def detector_text(result: RunResult, label: str) -> str:
    """What is wrong with a detector, its settings, its pair-frames, and milliseconds by stage."""
    figures = result.summary["detectors"][label]
    parts = []
    for answer in result.answers:
        if answer.label == label:
            parts += [f"**{answer.sentence}**", *_reasons(answer)]
    parts.append(f"`{figures.get('asked', figures['name'])}`")
    if label in result.comparisons:
        head = (f"against {result.oracle}", *(OUTCOME_WORDS[kind].lower() for kind in FRAME_ROWS))
        counts = [result.summary["audit"][label]["pair_frames"][kind.name] for kind in FRAME_ROWS]
        parts.append(markdown(table("", head, [("pair-frames", *counts)])))
    rows = [(stage, f"{ms.mean():.4f}") for stage, ms in stage_ms(result.detections[label]).items()]
    return "\n\n".join([*parts, markdown(table("", ("stage", "ms a frame"), rows))])


def session_text(result: RunResult) -> str:
    """What was replayed, and what happened, of a run that compares nothing."""
    assembly = result.assembly
    parts = [f"# {result.session.scene.name or 'Session'}", replayed(result), *doubts(result)]
    if result.detections:
        parts.append(f"Detectors: {', '.join(result.detections)}.")
    else:
        parts += [f"- {line}" for line in happened_words(result.effects, MANY)] or [f"{NOT_LOOKED_FOR}."]
    if assembly.proxies:
        parts.append(f"Proxy meshes stand in for: {', '.join(assembly.proxies)}.")
    if assembly.left_out:
        parts.append(f"Without a mesh, so not examined: {', '.join(assembly.left_out)}.")
    parts += [f"- {note}" for note in assembly.notes]
    return "\n\n".join([*parts, f"*{CAVEAT}*"])
