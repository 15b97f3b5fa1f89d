"""Words beside the picture: the answer, the report, and clusters of misses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import rerun as rr

from replay.base.constants import CAVEAT
from replay.base.shown import shown
from replay.comparison.clusters import MANY, Cluster, clusters
from replay.comparison.misses import NEVER_FOUND
from replay.comparison.outcome import Miss
from replay.effects.effect_summary import happened_words
from replay.outputs.moments import FocusMoment, to_do
from replay.outputs.palette import MISSED, PARTLY_MISSED
from replay.outputs.rerun_log.columns import RecordingWriter, packed
from replay.outputs.run_tables import ranking_table
from replay.outputs.tables import markdown, table
from replay.outputs.words import FRAME_ROWS, NOT_LOOKED_FOR, OUTCOME_WORDS, counted, depth_words
from replay.pipeline.headline import beside, doubts, headlines, price, undecided
from replay.pipeline.ranking import Rank
from replay.pipeline.run_result import RunResult

RANK_COLUMNS: Final = (
    "detector",
    "what",
    "missed",
    "late or cut short",
    "undecided",
    "false contact",
    "mean ms",
    "p99 ms",
    "what to do",
)


def answer_text(result: RunResult) -> str:
    """What is wrong, why, what mends it, what that costs, and of several detectors the ranking, the worst first."""
    first = result.answers[0]
    parts = [f"## {first.sentence}"]
    if first.why:
        parts.append(f"**Why:** {first.why}")
    if first.fix is not None:
        command = f" `{first.fix.command}`" if first.fix.command else ""
        parts.append(f"**Fix:** {first.fix.words}{command}")
    parts.append(f"**Cost:** {' '.join(price(result))}")
    if len(result.ranking) > 2:
        parts.append(_ranks(result, result.ranking))
    return "\n\n".join([*parts, *undecided(result), *doubts(result), f"*{CAVEAT}*"])


def _ranks(result: RunResult, ranks: Sequence[Rank]) -> str:
    """The audited detectors; the oracle's time stands in the price."""
    made = ranking_table(result)
    made = replace(made, rows=made.rows[:-1])
    made = made.beside("what to do", [to_do(result, one.label) for one in ranks[:-1]]).only(*RANK_COLUMNS)
    return markdown(replace(made, title=""))


def report_text(result: RunResult) -> str:
    """The report in Markdown: what was replayed, what each detector missed and took."""
    assembly, times = result.assembly, result.assembly.motion.times
    span = float(times[-1] - times[0]) if len(times) else 0.0
    parts = [
        f"# {result.session.scene.name or 'Session'}",
        f"{span:.1f} s, {len(times):,} frames, {len(assembly.bodies)} bodies, {counted(len(assembly.pairs), 'pair')}.",
    ]
    parts += doubts(result)
    parts += [f"**{words}**" for words in headlines(result)]
    if len(result.comparisons) > 1:
        parts.append(markdown(ranking_table(result)))
    parts += [*beside(result), *price(result)]
    if not result.detections:
        parts += [f"- {line}" for line in happened_words(result.effects, MANY)]
    parts.append(_outcome_table(result))
    if assembly.proxies:
        parts.append(f"Proxy meshes stand in for: {', '.join(assembly.proxies)}.")
    if assembly.left_out:
        parts.append(f"Without a mesh, so not examined: {', '.join(assembly.left_out)}.")
    if result.holdings:
        held = dict.fromkeys(assembly.pair_name(one.pair) for one in result.holdings)
        parts.append(f"While a hand holds it, not counted: {', '.join(held)}.")
    parts += [f"- {note}" for note in assembly.notes]
    return "\n\n".join([*parts, f"*{CAVEAT}*"])


def _outcome_table(result: RunResult) -> str:
    if not result.comparisons:
        return f"Detectors: {', '.join(result.detections)}." if result.detections else f"{NOT_LOOKED_FOR}."
    head = (f"pair-frames against {result.oracle}", *(OUTCOME_WORDS[kind].lower() for kind in FRAME_ROWS))
    rows = [(label, *(one.count(kind) for kind in FRAME_ROWS)) for label, one in result.comparisons.items()]
    return markdown(table("", head, rows))


def log_cluster_list(writer: RecordingWriter, path: str, misses: Sequence[Miss], at: Mapping[int, FocusMoment]) -> None:
    """Send one line per cluster at its deepest moment, ``at`` of a number, where there are too many for a line each."""
    if len(misses) <= MANY:
        return
    found = sorted(clusters(misses), key=lambda one: (at[one.deepest.number].frame, at[one.deepest.number].later))
    moments = [at[one.deepest.number] for one in found]
    width = max(len(f"{one.deepest.body_a}-{one.deepest.body_b}") for one in found)
    whole = (all(miss.kind == NEVER_FOUND for miss in one.misses) for one in found)
    columns = rr.TextLog.columns(
        text=[shown(_cluster_line(one, width)) for one in found], level=["cluster"] * len(found),
        color=packed(MISSED if one else PARTLY_MISSED for one in whole),
    )  # fmt: skip
    writer.rows_later(path, [(one.frame, one.later) for one in moments], columns)


def _cluster_line(cluster: Cluster, width: int) -> str:
    one, (start, end) = cluster.deepest, cluster.span
    name, depth = f"{one.body_a}-{one.body_b}", depth_words(one, " mm", 5)
    return f"{len(cluster.misses):>4} x {name:<{width}}  {start:6.1f} to {end:6.1f} s  {depth}  (miss {one.number})"
