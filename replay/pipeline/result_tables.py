"""Contacts, misses, false contacts and events of a run as tables: what each column holds is said here, once."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from replay.base.tables import Column, Table
from replay.comparison.holding import within
from replay.comparison.outcome import Episode
from replay.effects.output import plain_value
from replay.pipeline.run_result import RunResult
from replay.prepare.flags import flag_word


def axes(name: str, meaning: str, unit: str = "") -> tuple[Column, ...]:
    """Three columns of a vector of the world."""
    return tuple(Column(f"{name}_{axis}", float, meaning, f"thing.{name}.{k}", unit) for k, axis in enumerate("xyz"))


HEADS: Final = (
    Column("detector", str, "label of the detector", "label"),
    Column("number", int, "counts from 1 within a detector, in order of time"),
    Column("body_a", str, "first body of the pair", "bodies.0"),
    Column("body_b", str, "second body of the pair", "bodies.1"),
    Column("held", bool, "a hand and what it holds, or a body and its parent"),
    Column("first", int, "first frame", "thing.first"),
    Column("last", int, "last frame, included", "thing.last"),
)
SPAN: Final = (
    Column("start", float, "when its first frame is", "thing.start", "s"),
    Column("end", float, "when its last frame is over", "thing.end", "s"),
)
NOISE: Final = (
    Column(
        "noise", str, "whether the contact of the reference holds in spite of tracker noise; null: not asked", "noise.0"
    ),
    Column("noise_share", float, "share of noisy copies that have the contact", "noise.1"),
)

WHY: Final = Column("why", str, "the sentence about it", "thing.why")

EPISODES: Final = (
    *HEADS,
    Column("frames", int, "frames in contact", "thing.frames"),
    Column("frames_lost", int, "frames within it without a pose", "thing.frames_lost"),
    Column("cuts", int, "stretches of lost poses that cut it: before, within and after", "thing.cuts"),
    *SPAN,
    Column("missed_by", str, "detectors that never found it, with commas"),
    Column("flag", str, "what was in doubt about a pose in it; null: nothing"),
    Column("status", str, "of an audited one: matched, piece, invented, excused, held"),
    Column("truth", int, "number of the contact of the reference that it matches", "match.truth"),
    Column("overlap_frames", int, "frames in common with that one", "match.overlap"),
    Column("onset_error", float, "how much later it begins than that one", "match.onset_error", "s"),
    Column("duration_error", float, "how much longer it is than that one", "match.duration_error", "s"),
    *NOISE,
)

MISSES: Final = (
    *HEADS,
    Column("frames", int, "frames missed", "thing.frames"),
    *SPAN,
    Column("kind", str, "never found, found late, lost early or interrupted", "thing.kind"),
    Column("episode", int, "number of the contact of the reference", "thing.episode"),
    Column("deepest", int, "frame in which the surfaces cut longest", "thing.deepest"),
    Column("face_pairs", int, "pairs of faces that meet there", "thing.face_pairs"),
    Column("cut_length", float, "length of the intersection curve there", "thing.cut_length", "m"),
    Column("cause", str, "the stage that lost it", "thing.cause"),
    *axes("point", "where, at the deepest frame or the first touch, in the world", "m"),
    *axes("normal", "unit direction from the first body to the second there"),
    Column("touch", float, "when a contact begins that no frame shows", "thing.touch.moment", "s"),
    Column("face_a", int, "face of the first body that touches first", "thing.touch.faces.0"),
    Column("face_b", int, "face of the second body that touches first", "thing.touch.faces.1"),
    Column("touch_free", float, "nothing touches before", "thing.touch.free", "s"),
    *NOISE,
    WHY,
)

FALSE_CONTACTS: Final = (
    *HEADS,
    Column("frames", int, "frames that are false", "thing.frames"),
    *SPAN,
    Column("kind", str, "nothing there, starts early, ends late or joins two contacts", "thing.kind"),
    Column("widest", int, "frame in which the surfaces are farthest apart, of those looked at", "thing.widest"),
    Column("cause", str, "why it was reported", "thing.cause"),
    *axes("point", "the middle between the nearest points there, in the world", "m"),
    Column("gap", float, "between the surfaces there; null: not measured", "thing.gap", "m"),
    Column("hollow", str, "body whose convex hull fills a hollow", lambda row: row["thing"].hollow or None),
    WHY,
)


EVENTS: Final = (
    Column("stamp_ns", int, "when it begins, on the clock of the recording", unit="ns"),
    Column("end_stamp_ns", int, "when it ends; null: it is a moment", unit="ns"),
    Column("source", str, "`event`, the kind of a span, or `effect/` and a kind"),
    Column("name", str, "what happened"),
    Column("body", str, "whom it is about"),
    Column("level", str, "info, warning or error"),
    Column("message", str, "the sentence about it"),
    Column("values", str, "numbers of an effect, as JSON; empty of what was recorded"),
    Column("time", float, "when it begins", unit="s"),
    Column("end_time", float, "when it ends", unit="s"),
)

EFFECT: Final = "effect/"
"""``source`` of an event that an effect found: this and its kind."""


def result_tables(result: RunResult) -> dict[str, Table]:
    """The tables of a run, in order of time: contacts, misses and false contacts of every detector, and events."""
    return {
        "episodes": _episodes(result),
        "misses": Table.of(
            MISSES, _entries(result, result.misses, lambda _, __, miss: {"noise": _in_noise(result, miss.episode)})
        ),
        "false": Table.of(FALSE_CONTACTS, _entries(result, result.false, lambda *_: {})),
        "events": Table.of(EVENTS, sorted(_events(result), key=lambda row: row["stamp_ns"])),
    }


def _events(result: RunResult) -> Iterator[dict[str, Any]]:
    """What the recording says happened, and what the effects found: moments, and spans with an end."""
    zero = result.assembly.first_ns
    for event in result.session.events:
        yield _event(
            zero, (event.time_ns, None), "event", name=event.name, body=event.body, level=event.level,
            message=event.message,
        )  # fmt: skip
    for span in result.session.intervals:
        said = "; ".join(f"{key}={value}" for key, value in span.data.items())
        yield _event(zero, (span.start_ns, span.end_ns), span.kind, name=span.name, message=said)
    for kind, run in result.effects.items():
        for found in run.events:
            end = None if found.end is None else zero + round(found.end * 1e9)
            values = dict(found.values) | ({} if found.point is None else {"point": list(found.point)})
            yield _event(
                zero, (zero + round(found.time * 1e9), end), EFFECT + kind, name=found.name,
                body=" ".join(found.bodies), level=found.level, message=found.text,
                values=json.dumps(values, sort_keys=True, default=plain_value),
            )  # fmt: skip


def _event(zero: int, stamps: tuple[int, int | None], source: str, **words: str) -> dict[str, Any]:
    """A row of the table of events; ``zero`` is the stamp of second 0."""
    stamp, end = stamps
    return {
        "stamp_ns": stamp, "end_stamp_ns": end, "source": source, "body": "", "level": "info", "values": "", **words,
        "time": (stamp - zero) / 1e9, "end_time": None if end is None else (end - zero) / 1e9,
    }  # fmt: skip


def _episodes(result: RunResult) -> Table:
    """Contacts, and what became of each."""
    never: dict[tuple[str, int], list[str]] = {}
    for label in result.comparisons:
        for number in result.counts[label].missed_numbers:
            never.setdefault((result.oracle, number), []).append(label)
    status = {label: matches.status() for label, matches in result.matches.items()}
    match = {(label, one.found): one for label, matches in result.matches.items() for one in matches.matched}

    def more(label: str, number: int, contact: Episode) -> dict[str, Any]:
        return {
            "noise": _in_noise(result, number) if label == result.oracle else (None, None),
            "missed_by": ",".join(never.get((label, number), ())),
            "flag": _doubt(result, contact),
            "status": status.get(label, {}).get(number, ""),
            "match": match.get((label, number)),
        }

    return Table.of(EPISODES, _entries(result, result.episodes, more))


def _entries(
    result: RunResult, found: Mapping[str, Sequence[Any]], more: Callable[[str, int, Any], dict[str, Any]]
) -> Iterator[dict[str, Any]]:
    """What was found of each detector, numbered in order of time, and what the run says ``more`` of each elsewhere.

    ``thing`` is an ``Episode``, a ``Miss`` or a ``FalseContact``.
    """
    for label, things in found.items():
        spans = np.array([(thing.pair, thing.first, thing.last) for thing in things], dtype=np.int64).reshape(-1, 3)
        held = result.assembly.held[spans[:, 0]] | within(result.holdings, *spans.T)
        for number, (thing, is_held) in enumerate(zip(things, held.tolist(), strict=True), 1):
            bodies = result.assembly.bodies_of(thing.pair)
            row = {"label": label, "number": number, "thing": thing, "bodies": bodies, "held": is_held}
            yield row | more(label, number, thing)


def _in_noise(result: RunResult, number: int) -> tuple[str | None, float | None]:
    """Word and share of a contact of the oracle in noisy copies."""
    noise = result.noise
    return (None, None) if noise is None else (noise.words[number - 1], noise.contacts[number - 1].share)


def _doubt(result: RunResult, contact: Episode) -> str | None:
    """What is in doubt about any pose in a contact."""
    part = result.flags.bodies[contact.first : contact.last + 1, result.assembly.pairs[contact.pair]]
    return flag_word(int(np.bitwise_or.reduce(part, axis=None))) or None
