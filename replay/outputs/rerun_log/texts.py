"""Words of the picture: the answer, what accuracy costs, and what was replayed. The figures are those of the run."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from replay.base.constants import CAVEAT
from replay.comparison.misses import MANY
from replay.effects.effect_summary import happened_words
from replay.outputs.palette import Rgba
from replay.outputs.plots import Dot
from replay.outputs.rerun_log.timing import colour_of, stage_ms
from replay.outputs.run_tables import FALSE_CONTACT, RANKING, sampling_notes
from replay.outputs.tables import Column, Table, markdown, table
from replay.outputs.words import FRAME_ROWS, NOT_LOOKED_FOR, OUTCOME_WORDS, counted
from replay.pipeline.answer import Answer, KeyMoment, milliseconds
from replay.pipeline.headline import doubts, price, undecided
from replay.pipeline.ranking import part_of
from replay.pipeline.run_result import RunResult

ACCURACY: Final = "accuracy/text"
SESSION_TEXT: Final = "session"

NO_BREAK: Final = "\u00a0"
"""A space at which no line is broken: between a number and its unit."""

HEADS: Final = {"late or cut short": "late or cut short", FALSE_CONTACT: "false", "mean ms": "ms", "p99 ms": "p99"}
"""Short heads: at 1,280 pixels all columns fit."""


def answer_text(result: RunResult) -> str:
    """What is wrong, why, what mends it, what being right costs, and the ranking, the worst first."""
    first = result.answers[0]
    title = f"# {first.sentence.removesuffix('.').replace(' %', NO_BREAK + '%')}"
    parts = [*doubts(result), title, *_reasons(first)]
    parts.append(f"**Cost** {' '.join(price(result))}")
    if len(result.ranking) > 2:
        parts.append(ranking_text(result))
    if first.moment is not None:
        parts.append(f"**Close-up** {_moment_words(result, first, first.moment)}")
    parts += [*undecided(result), *sampling_notes(result), f"*{replayed(result)} {CAVEAT}*"]
    return "\n\n".join(parts)


def _reasons(answer: Answer) -> list[str]:
    """Why, and what mends it."""
    parts = [f"**Why** {answer.why}"] if answer.why else []
    if answer.fix is not None:
        command = f" `{answer.fix.command}`" if answer.fix.command else ""
        parts.append(f"**Fix** {answer.fix.words}{command}")
    return parts


def ranking_text(result: RunResult) -> str:
    """Every detector in Markdown: its name and what it is in one column, so that all fit beside a picture."""
    named = Column(
        counted(result.ranking[-1].contacts, "contact"), of=lambda rank: f"{rank.label}:{NO_BREAK}{rank.what}"
    )
    some = any(rank.undecided for rank in result.ranking)
    shown = ("missed", *(["undecided"] if some else []), *HEADS)
    columns = (replace(column, name=HEADS.get(column.name, column.name)) for column in RANKING if column.name in shown)
    return markdown(Table.of([named, *columns], result.ranking))


def _moment_words(result: RunResult, answer: Answer, moment: KeyMoment) -> str:
    """When the close-up is, what it shows, and the command that leads there."""
    of = len(result.misses[answer.label] if moment.kind == "miss" else result.false[answer.label])
    what = f"{'miss' if moment.kind == 'miss' else 'false contact'} {moment.number} of {of}"
    where = f"at {moment.seconds:.3f} s, {what} of {answer.label}: {' and '.join(moment.pair)}."
    return f"{where} `replay view RUN {moment.option} --by {answer.label}`"


def accuracy_text(result: RunResult) -> str:
    """What missing nothing costs, and what each detector does for its price."""
    reference = result.ranking[-1]
    lines = [f"# To miss nothing: {price(result)[0].removesuffix('.').replace(' %', NO_BREAK + '%')}"]
    if result.tradeoff is not None:
        lines = [f"# {result.tradeoff.answer}", *(f"- {sentence}" for sentence in result.tradeoff.advice[1:])]
        if result.tradeoff.cut:
            lines.append(f"Not tried, for want of time: {', '.join(result.tradeoff.cut)}.")
    for rank in result.ranking[:-1]:
        answer = next(one for one in result.answers if one.label == rank.label)
        lines.append(f"- {answer.sentence}")
    slow = [f"{rank.label} {milliseconds(rank.p99)} ms" for rank in result.ranking if rank.p99 is not None]
    if slow:
        timed = {label: figures["seconds"].get("per_frame") for label, figures in result.summary["detectors"].items()}
        longest, label = max((frame["max"], label) for label, frame in timed.items() if frame)
        lines.append(f"Slow frames (p99): {', '.join(slow)}. Longest frame: {label}, {1e3 * longest:.3g} ms.")
    notes = " ".join(price(result)[1:])
    return "\n\n".join([*lines, f"*{notes}*"]) if reference.mean is not None else lines[0]


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
    times, things = result.assembly.motion.times, (len(result.assembly.bodies), len(result.assembly.pairs))
    span = float(times[-1] - times[0]) if len(times) else 0.0
    return f"{span:.1f} s, {len(times):,} frames, {things[0]} bodies, {counted(things[1], 'pair')}."


def detector_text(result: RunResult, label: str) -> str:
    """What is wrong with a detector, its settings, its pair-frames, and milliseconds by stage."""
    figures, detection = result.summary["detectors"][label], result.detections[label]
    parts = [f"`{figures.get('asked', figures['name'])}`"]
    for answer in result.answers:
        if answer.label == label:
            parts = [f"**{answer.sentence}**", *_reasons(answer), *parts]
    if label in result.comparisons:
        head = (f"against {result.oracle}", *(OUTCOME_WORDS[kind].lower() for kind in FRAME_ROWS))
        counts = [result.comparisons[label].count(kind) for kind in FRAME_ROWS]
        parts.append(markdown(table("", head, [("pair-frames", *counts)])))
    rows = [(stage, f"{ms.mean():.4f}") for stage, ms in stage_ms(detection).items()]
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
