"""The tables of the report; every number in them stands in the result."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from replay.audit.clusters import MANY, clusters, seen_and_between
from replay.audit.misses import NEVER_FOUND
from replay.audit.outcome import Episode, Miss, Outcome
from replay.report.markup import Markup, element, joined, table
from replay.run_result import RunResult

MOST_ROWS: Final = 1000
"""Misses with a row of their own, some 400 kB of page."""

MISS_HEAD: Final = ("miss", "pair", "what", "cause", "look at it", "at s")


def fact_table(result: RunResult) -> Markup:
    """What was recorded, and what was done to it."""
    return table("Facts of the session", ("what", "value"), _facts(result), words=2)


def _facts(result: RunResult) -> Iterator[tuple[str, object]]:
    session = result.summary["session"]
    yield "length", f"{session['duration']:.1f} s, {session['frames']:,} frames"
    if session["median_step"]:
        yield "rate", f"{1.0 / session['median_step']:.1f} Hz (median)"
    yield "bodies", ", ".join(f"{name} ({body['faces']:,} faces)" for name, body in session["bodies"].items())
    yield "pairs looked at", len(result.assembly.pairs)
    yield from _gaps(result)
    for note in result.assembly.notes:
        yield "note", note
    for span in result.session.intervals:
        first = int(result.assembly.stamp_ns[0]) - round(float(result.assembly.motion.times[0]) * 1e9)
        yield span.kind, f"{span.name}: {(span.start_ns - first) / 1e9:.1f} to {(span.end_ns - first) / 1e9:.1f} s"
    for key, value in result.summary["session"]["facts"].items():
        if value != "not stated":
            yield key.replace("_", " "), value


def _gaps(result: RunResult) -> Iterator[tuple[str, object]]:
    """What a reader must know before believing anything: stand-ins, bodies and frames that were left out."""
    if result.assembly.proxies:
        yield "proxy meshes", f"stand in for the real ones of {', '.join(result.assembly.proxies)}"
    if result.assembly.left_out:
        yield "not looked at", f"no mesh: {', '.join(result.assembly.left_out)}"
    dropped = {why: count for why, count in result.summary["session"]["dropped_frames"].items() if count}
    if dropped:
        yield "frames left out", ", ".join(f"{count} {why}" for why, count in dropped.items())


def contact_table(result: RunResult) -> Markup:
    """A row per pair that touched, or was said to; in an audit the most missed first, as in the lanes."""
    short = ("pair", "contacts", "seconds", "longest s")
    if not result.comparisons:
        every = range(len(result.assembly.pairs))
        return joined(
            table(
                f"Contacts found by {label}",
                short,
                [_contacts(result, label, pair) for pair in every if _of(found, pair)],
            )
            for label, found in result.episodes.items()
        )
    head = (*short, "never found", "in part", "frames missed", "frames invented")
    tables = []
    for label, comparison in result.comparisons.items():
        excused = (comparison.outcome == Outcome.WITHIN_TOLERANCE).sum(axis=0).tolist()
        told = (comparison.outcome == Outcome.INVENTED).any(axis=0) | np.array(excused, dtype=np.bool_)
        touched = {episode.pair for episode in result.episodes[result.oracle]} | set(np.flatnonzero(told).tolist())
        missed, wrong = ((comparison.outcome == word).sum(axis=0) for word in (Outcome.MISSED, Outcome.INVENTED))
        pairs = sorted(touched, key=lambda pair: (-int(missed[pair]), -int(wrong[pair]), pair))
        rows = [(*_contacts(result, result.oracle, pair), *_audit(result, label, pair)) for pair in pairs]
        names: tuple[str, ...] = head
        if any(excused):
            names = (*head, "within tolerance")
            rows = [(*row, excused[pair]) for row, pair in zip(rows, pairs, strict=True)]
        tables.append(table(f"Contacts ({result.oracle}) and what {label} made of them", names, rows))
    return joined(tables)


def _of(found: Sequence[Episode], pair: int) -> list[float]:
    return [episode.end - episode.start for episode in found if episode.pair == pair]


def _contacts(result: RunResult, label: str, pair: int) -> tuple[object, ...]:
    own = _of(result.episodes[label], pair)
    held = " (held)" if result.assembly.held[pair] else ""
    return result.assembly.pair_name(pair) + held, len(own), f"{sum(own):.3f}", f"{max(own, default=0.0):.3f}"


def _audit(result: RunResult, label: str, pair: int) -> tuple[int, int, int, int]:
    misses = [miss for miss in result.misses[label] if miss.pair == pair]
    outcome = result.comparisons[label].outcome[:, pair]
    whole = len({miss.episode for miss in misses if miss.kind == NEVER_FOUND})
    part = sum(miss.kind != NEVER_FOUND for miss in misses)
    return whole, part, int((outcome == Outcome.MISSED).sum()), int((outcome == Outcome.INVENTED).sum())


def miss_table(result: RunResult, label: str) -> Markup:
    """A row per miss, deepest first, with the command that shows it; where there are many, clusters above them.

    Misses that no frame shows have a table of their own, in order of time.
    """
    run, misses = result.out or "RUN", result.misses[label]
    seen, between = seen_and_between(misses)
    shown, hidden = seen[:MOST_ROWS], between[:MOST_ROWS]
    parts = []
    if shown:
        rows: list[tuple[object, ...]] = [
            (*_miss(run, one), one.last - one.first + 1, f"{one.cut_length * 1e3:.1f}", one.face_pairs) for one in shown
        ]
        parts.append(table(f"What {label} missed", (*MISS_HEAD, "frames", "cut mm", "face pairs"), rows, words=5))
    if hidden:
        words = f"What {label} missed between frames: no frame shows it, so it has no depth; in order of time"
        rows = [(*_miss(run, one), one.shown[0], _touching(one)) for one in hidden]
        parts.append(table(words, (*MISS_HEAD, "after frame", "first faces"), rows, words=5))
    if len(misses) <= MANY:
        return joined(parts)
    count = len(shown) + len(hidden)
    words = f"All {count:,}, each with the command that shows it"
    if count < len(misses):
        words = (
            f"The {count:,} deepest, each with the command that shows it; the other {len(misses) - count:,} are in "
            "misses.parquet"
        )
    return joined([_cluster_table(run, label, misses), element("details", element("summary", words), *parts)])


def _miss(run: object, miss: Miss) -> tuple[object, ...]:
    """The cells below ``MISS_HEAD``."""
    look = element("code", f"replay view {run} --miss {miss.number}")
    pair = f"{miss.body_a} - {miss.body_b}"
    return element("b", miss.number), pair, miss.kind, miss.cause, look, f"{miss.seconds:.3f}"


def _touching(miss: Miss) -> str:
    return "" if miss.touch is None else "{} and {}".format(*miss.touch.faces)


def _cluster_table(run: object, label: str, misses: Sequence[Miss]) -> Markup:
    rows = []
    for cluster in clusters(misses):
        one, (start, end) = cluster.deepest, cluster.span
        rows.append(
            (
                f"{one.body_a} - {one.body_b}",
                cluster.causes,
                element("code", f"replay view {run} --miss {one.number}"),
                len(cluster.misses),
                cluster.frames,
                f"{start:.2f} to {end:.2f}",
                f"{one.cut_length * 1e3:.1f}" if one.touch is None else "between frames",
            )
        )
    head = ("pair", "cause", "look at the deepest", "misses", "frames", "s", "deepest cut mm")
    return table(f"{len(misses):,} misses of {label} in {len(rows)} clusters, deepest first", head, rows, words=3)


def cost_table(result: RunResult) -> Markup:
    """What each detector took."""
    rows = []
    for label, told in result.summary["detectors"].items():
        seconds = told["seconds"]
        frame = seconds.get("per_frame")
        cells = [f"{frame[key] * 1e3:.3f}" if frame else "" for key in ("median", "p99", "max")]
        role = "oracle" if label == result.oracle else "frame by frame" if told["online"] else "whole motion at once"
        mean = f"{seconds['per_frame_mean'] * 1e3:.3f}"
        rows.append((label, role, f"{seconds['detect']:.3f}", mean, *cells))
    head = ("detector", "how", "whole s", "mean ms", "median ms", "99 % ms", "worst ms")
    return table("Time of each detector", head, rows, words=2)


def settings_table(result: RunResult) -> Markup:
    """Settings, digests and machine: what it takes to get the same figures again."""
    rows: list[tuple[object, object]] = [("session", result.summary["session"]["origin"] or "in memory")]
    rows.append(("seed", result.summary["seed"]))
    for label, told in result.summary["detectors"].items():
        settings = json.dumps(told["settings"], sort_keys=True)
        rows.append((label, f"{told['name']} {settings}, verdicts SHA-256 {told['digest']}"))
    rows += [(name, value) for name, value in result.summary["machine"].items()]
    rows.append(("versions", ", ".join(f"{name} {value}" for name, value in result.summary["versions"].items())))
    return table("Settings, digests and machine", ("what", "value"), rows, words=2)
