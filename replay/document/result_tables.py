"""Contacts, misses, false contacts and events of a run as tables, and faults read again from such rows."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import msgspec
import numpy as np

from cdcore.protocol import counts_as_contact
from replay.auditing.fault import Fault
from replay.auditing.holding import are_grasped
from replay.auditing.outcome import Episode
from replay.document.columns import field_values, file_columns
from replay.document.contact import EFFECT_PREFIX
from replay.document.run_document import StoredTable
from replay.document.run_result import RunResult
from replay.document.tables import Table
from replay.effects.output import plain_value
from replay.prepare.flags import flag_word


def result_tables(result: RunResult) -> dict[str, Table]:
    """The tables of a run, in order of time: contacts, misses and false contacts of every detector, and events."""
    return {
        "episodes": Table.of(file_columns("episodes"), _contact_rows(result)),
        "misses": Table.of(file_columns("misses"), chain.from_iterable(result.misses.values())),
        "false": Table.of(file_columns("false"), chain.from_iterable(result.false.values())),
        "events": Table.of(file_columns("events"), sorted(_event_rows(result), key=lambda row: row["stamp_ns"])),
    }


def stored_table(table_name: str, table: Table) -> StoredTable:
    """Return how the document names a table: its file in the run folder, and its number of rows."""
    return StoredTable(file=f"{table_name}.parquet", rows=len(table.rows))


def faults_of_rows(table_name: str, rows: Iterable[Mapping[str, Any]], pairs: Sequence[str]) -> Iterator[Fault]:
    """Yield the faults of the rows of a table, ``misses`` or ``false``.

    ``pairs``: names of all pairs. The faces that meet and the first touch are not in the tables. Raises
    ``ValueError``: a run has no such kind, cause or pair.
    """
    columns = file_columns(table_name)
    for fault_row in rows:
        fields = field_values(columns, fault_row)
        evidence = fields.get("evidence", {})
        evidence.pop("touch", None)
        bodies = tuple(fields["bodies"].values())
        fault_fields = {
            **fields,
            **_vector_fields(fields),
            "evidence": {**evidence, **_vector_fields(evidence)},
            "bodies": bodies,
            "labels": bodies,
            "pair": pairs.index("-".join(bodies)),
        }
        try:
            yield msgspec.convert(fault_fields, Fault)
        except msgspec.ValidationError as error:
            raise ValueError(str(error)) from error


def _vector_fields(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that have three numbers, as such."""
    return {name: tuple(value.values()) for name, value in fields.items() if name in ("point", "normal")}


def _event_rows(result: RunResult) -> Iterator[dict[str, Any]]:
    """Yield the events of the recording and of the effects: moments, and intervals with an end."""
    first_ns = result.assembly.first_ns
    for event in result.session.events:
        yield _event_row(
            first_ns,
            (event.time_ns, None),
            "event",
            name=event.name,
            body=event.body,
            level=event.level,
            message=event.message,
        )
    for named_interval in result.session.intervals:
        fields_text = "; ".join(f"{key}={value}" for key, value in named_interval.data.items())
        yield _event_row(
            first_ns,
            (named_interval.start_ns, named_interval.end_ns),
            named_interval.kind,
            name=named_interval.name,
            message=fields_text,
        )
    for kind, run in result.effects.items():
        for effect_event in run.events:
            end_ns = None if effect_event.end is None else first_ns + round(effect_event.end * 1e9)
            event_values = dict(effect_event.values) | (
                {} if effect_event.point is None else {"point": list(effect_event.point)}
            )
            yield _event_row(
                first_ns,
                (first_ns + round(effect_event.time * 1e9), end_ns),
                EFFECT_PREFIX + kind,
                name=effect_event.name,
                body=" ".join(effect_event.bodies),
                level=effect_event.level,
                message=effect_event.text,
                values=json.dumps(event_values, sort_keys=True, default=plain_value),
            )


def _event_row(first_ns: int, stamps: tuple[int, int | None], source: str, **columns: str) -> dict[str, Any]:
    """A row of the table of events; ``first_ns`` is the stamp of second 0."""
    stamp, end = stamps
    return {
        "stamp_ns": stamp,
        "end_stamp_ns": end,
        "source": source,
        "body": "",
        "level": "info",
        "values": "",
        **columns,
        "time": (stamp - first_ns) / 1e9,
        "end_time": None if end is None else (end - first_ns) / 1e9,
    }


def _contact_rows(result: RunResult) -> Iterator[dict[str, Any]]:
    """Yield the contacts of each detector, numbered in order of time, and what became of each."""
    missed_by_contact: dict[tuple[str, int], list[str]] = {}
    for label in result.comparisons:
        for number in result.counts[label].missed_numbers:
            missed_by_contact.setdefault((result.oracle, number), []).append(label)
    status = {label: matches.status() for label, matches in result.matches.items()}
    match = {(label, pair.reported): pair for label, matches in result.matches.items() for pair in matches.matched}
    for label, contacts in result.episodes.items():
        is_reference = label == result.oracle
        segments = [(contact.pair, contact.first, contact.last) for contact in contacts]
        grasped = are_grasped(result.assembly, result.holdings, segments)
        for number, contact in enumerate(contacts, start=1):
            noise = _in_noise(result, number) if is_reference else (None, None)
            yield {
                "detector": label,
                "number": number,
                "bodies": result.assembly.things_of(contact.pair),
                "grasped": grasped[number - 1],
                "first": contact.first,
                "last": contact.last,
                "start": contact.start,
                "end": contact.end,
                "frames": contact.frames,
                "frames_lost": contact.frames_lost,
                "cuts": contact.cuts,
                "noise": noise[0],
                "noise_fraction": noise[1],
                "missed_by": ",".join(missed_by_contact.get((label, number), ())),
                "members": _first_members(result, label, contact),
                "flag": _doubt(result, contact),
                "status": status.get(label, {}).get(number, ""),
                "match": match.get((label, number)),
                "depth": result.depths[number - 1] if is_reference and result.depths else None,
            }


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
