"""Contacts, misses, false contacts and events of a run as tables: what each column holds is said here, once."""

import json
from collections.abc import Iterator, Mapping, Sequence
from math import nan
from typing import Any, Final

import numpy as np

from cdcore.protocol import counts_as_contact
from replay.auditing.fault import Cause, Evidence, Fault, FaultKind
from replay.auditing.holding import within
from replay.auditing.outcome import Episode
from replay.document.contact import EFFECT
from replay.document.run_document import StoredTable
from replay.document.run_result import RunResult
from replay.document.tables import Table, columns_of
from replay.effects.output import plain_value, vector_of
from replay.prepare.flags import flag_word

COLUMNS: Final = columns_of("document/result_tables.toml")


def result_tables(result: RunResult) -> dict[str, Table]:
    """The tables of a run, in order of time: contacts, misses and false contacts of every detector, and events."""
    noise = {
        label: [{"noise": _in_noise(result, miss.contact)} for miss in misses]
        for label, misses in result.misses.items()
    }
    hollows = {
        label: [{"hollow": contact.evidence.hollow or None} for contact in false]
        for label, false in result.false.items()
    }
    misses = _entries(result, result.misses, noise)
    false = _entries(result, result.false, hollows)
    return {
        "episodes": _episodes(result),
        "misses": Table.of(COLUMNS["misses"], misses),
        "false": Table.of(COLUMNS["false"], false),
        "events": Table.of(COLUMNS["events"], sorted(_events(result), key=lambda row: row["stamp_ns"])),
    }


def stored(name: str, table: Table) -> StoredTable:
    """Return how the document names a table: its file in the run folder, and its number of rows."""
    return StoredTable(file=f"{name}.parquet", rows=len(table.rows))


def fault_of_row(row: Mapping[str, Any], pairs: Sequence[str]) -> Fault:
    """Return the fault of a row of the table of misses or of false contacts.

    ``pairs``: names of all pairs. The faces that meet and the first touch are not in the tables. Raises
    ``ValueError``: a run has no such kind, cause or pair.
    """
    kind = FaultKind(row["kind"])
    frame = row.get("deepest") if kind.is_miss else row.get("widest")
    metres = row.get("cut_length") if kind.is_miss else row.get("gap")
    point = [row.get(f"point_{axis}") or 0.0 for axis in "xyz"]
    bodies = row["body_a"], row["body_b"]
    return Fault(
        number=row["number"],
        detector=row["detector"],
        pair=pairs.index("-".join(bodies)),
        bodies=bodies,
        labels=bodies,
        kind=kind,
        first=row["first"],
        last=row["last"],
        start=row["start"],
        end=row["end"],
        frame=row["first"] if frame is None else frame,
        point=vector_of(np.array(point)),
        metres=nan if metres is None else metres,
        depth=_or_nan(row.get("depth")),
        volume=_or_nan(row.get("common_volume")),
        depth_at_least=bool(row.get("depth_at_least")),
        not_measured=row.get("depth_unknown") or "",
        evidence=Evidence(hollow=row.get("hollow") or "", face_pairs=row.get("face_pairs") or 0),
        contact=row.get("episode") or 0,
        cause=Cause(row["cause"]),
        why=row.get("why") or "",
        noise=row.get("noise") or "",
    )


def _or_nan(value: float | None) -> float:
    return nan if value is None else value


def _events(result: RunResult) -> Iterator[dict[str, Any]]:
    """Yield the events of the recording and of the effects: moments, and intervals with an end."""
    zero = result.assembly.first_ns
    for event in result.session.events:
        yield _event(
            zero,
            (event.time_ns, None),
            "event",
            name=event.name,
            body=event.body,
            level=event.level,
            message=event.message,
        )
    for span in result.session.intervals:
        fields = "; ".join(f"{key}={value}" for key, value in span.data.items())
        yield _event(zero, (span.start_ns, span.end_ns), span.kind, name=span.name, message=fields)
    for kind, run in result.effects.items():
        for reported in run.events:
            end = None if reported.end is None else zero + round(reported.end * 1e9)
            values = dict(reported.values) | ({} if reported.point is None else {"point": list(reported.point)})
            yield _event(
                zero,
                (zero + round(reported.time * 1e9), end),
                EFFECT + kind,
                name=reported.name,
                body=" ".join(reported.bodies),
                level=reported.level,
                message=reported.text,
                values=json.dumps(values, sort_keys=True, default=plain_value),
            )


def _event(zero: int, stamps: tuple[int, int | None], source: str, **columns: str) -> dict[str, Any]:
    """A row of the table of events; ``zero`` is the stamp of second 0."""
    stamp, end = stamps
    return {
        "stamp_ns": stamp,
        "end_stamp_ns": end,
        "source": source,
        "body": "",
        "level": "info",
        "values": "",
        **columns,
        "time": (stamp - zero) / 1e9,
        "end_time": None if end is None else (end - zero) / 1e9,
    }


def _episodes(result: RunResult) -> Table:
    """Contacts, and what became of each."""
    never: dict[tuple[str, int], list[str]] = {}
    for label in result.comparisons:
        for number in result.counts[label].missed_numbers:
            never.setdefault((result.oracle, number), []).append(label)
    status = {label: matches.status() for label, matches in result.matches.items()}
    match = {(label, pair.reported): pair for label, matches in result.matches.items() for pair in matches.matched}

    outcomes = {
        label: [
            {
                "noise": _in_noise(result, number) if label == result.oracle else (None, None),
                "missed_by": ",".join(never.get((label, number), ())),
                "members": _first_members(result, label, contact),
                "flag": _doubt(result, contact),
                "status": status.get(label, {}).get(number, ""),
                "match": match.get((label, number)),
                "depth": result.depths[number - 1] if label == result.oracle and result.depths else None,
            }
            for number, contact in enumerate(contacts, start=1)
        ]
        for label, contacts in result.episodes.items()
    }
    return Table.of(COLUMNS["episodes"], _entries(result, result.episodes, outcomes))


def _entries(
    result: RunResult, by_detector: Mapping[str, Sequence[Any]], values: Mapping[str, Sequence[dict[str, Any]]]
) -> Iterator[dict[str, Any]]:
    """Yield the contacts or faults of each detector, numbered in order of time, each with its other ``values``.

    ``thing`` is an ``Episode`` or a ``Fault``.
    """
    for label, things in by_detector.items():
        spans = np.array([(thing.pair, thing.first, thing.last) for thing in things], dtype=np.int64).reshape(-1, 3)
        grasped = result.assembly.grasped[spans[:, 0]] | within(result.holdings, *spans.T)
        for number, (thing, is_grasped) in enumerate(zip(things, grasped.tolist(), strict=True), 1):
            bodies = result.assembly.things_of(thing.pair)
            row = {"label": label, "number": number, "thing": thing, "bodies": bodies, "held": is_grasped}
            yield row | values[label][number - 1]


def _in_noise(result: RunResult, number: int) -> tuple[str | None, float | None]:
    """Word and share of a contact of the oracle in noisy copies."""
    noise = result.noise
    return (None, None) if noise is None else (noise.labels[number - 1], noise.contacts[number - 1].fraction)


def _first_members(result: RunResult, label: str, contact: Episode) -> str | None:
    """Return the members of a group that a detector reports in the first frame of a contact, with commas."""
    assembly = result.assembly
    columns = assembly.columns_of_contact(contact.pair)
    names = dict[str, None]()
    reported = counts_as_contact(result.detections[label].verdict[contact.first, columns])
    for column, is_contact in zip(columns, reported.tolist(), strict=True):
        bodies, things = assembly.bodies_of(column), assembly.things_of(column)
        members = [body for body, thing in zip(bodies, things, strict=True) if body != thing]
        names |= dict.fromkeys(members if is_contact else ())
    return ", ".join(names) or None


def _doubt(result: RunResult, contact: Episode) -> str | None:
    """Return the doubts about any pose in a contact."""
    pose_flags = result.flags.bodies[contact.first : contact.last + 1, result.assembly.pairs[contact.pair]]
    return flag_word(int(np.bitwise_or.reduce(pose_flags, axis=None))) or None
