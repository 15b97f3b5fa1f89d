"""Adds contacts that an engine reported to a session: their clock is fitted to true contacts, with a residual."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from replay.auditing.clock_offset import ClockFacts, ClockOffset, estimate_offset
from replay.detection.progress import Progress
from replay.detection.recorded import (
    CLOCK_FACT,
    DRIFT_FACT,
    OFFSET_FACT,
    ReportClock,
    physics_steps,
    reported_spans,
)
from replay.document.run_result import RunResult
from replay.engine import compute
from replay.errors import AuditError
from replay.prepare.assemble import RESIDUAL_FACT
from replay.prepare.frame_times import frame_ends
from replay.words import plural
from sessions import Session
from sessions.importers.contacts_csv import read_contacts
from sessions.importers.ledger import FACT as LEDGER_FACT
from sessions.importers.ledger import Ledger, ledger_of
from sessions.input_files import nearest
from sessions.model.event import LiveContact
from sessions.quantities import duration

MOST_TIMES_LONGER: Final = 10.0
"""Reports that last so many times as long as the session are not on a clock of seconds."""

Moments = dict[tuple[str, str, str], list[float]]


def import_contacts(
    source: str | Path, session: Session, *, offset: float | None = None, progress: Progress | None = None
) -> tuple[Session, ClockOffset]:
    """The session with the contacts of a CSV in place of those it had, on the session's clock.

    Parameters
    ----------
    source : rows ``time, a, b, begin|end``, seconds on any clock.
    session : with the meshes, so that true contacts can be found.
    offset : seconds to add to the CSV's times, so that 0 is the first frame; ``None``: estimated.

    Raises ``ImportFileError``: a file that is not what it should be; names the line; ``AuditError``: no report is of
    two bodies of the session, nothing to estimate the offset from, or reports before the session or all after it.
    """
    ledger = ledger_of(session.facts) or Ledger(source)
    contacts = read_contacts(source, ledger)
    _check_names(source, contacts, session)
    result = compute(session, detectors="exact", oracle="none", offline=True, progress=progress)
    facts_of_clocks = _clock_facts(contacts, result)
    try:
        clock_fit = estimate_offset(_reported_moments(contacts), _true_moments(result), offset, facts_of_clocks)
    except AuditError as error:
        raise AuditError(f"{error}{_unit_hint(contacts, session)}") from None
    contacts_on_session_clock = tuple(
        replace(
            contact,
            time_ns=contact.time_ns + result.assembly.first_ns + round(1e9 * clock_fit.at(contact.time_ns / 1e9)),
        )
        for contact in contacts
    )
    _check_times(source, contacts_on_session_clock, session, _unit_hint(contacts, session))
    if clock_fit.is_own_clock:
        clock, residual = ReportClock.OWN, "0"
    else:
        clock = ReportClock.FITTED if offset is None else ReportClock.GIVEN
        residual = "unknown" if clock_fit.residual is None else f"{clock_fit.residual:.9f}"
    facts = {
        **session.facts,
        CLOCK_FACT: clock.value,
        OFFSET_FACT: f"{clock_fit.seconds:.9f}",
        DRIFT_FACT: f"{clock_fit.drift:.9f}",
        RESIDUAL_FACT: residual,
        LEDGER_FACT: ledger.as_text(),
    }
    return replace(session, live_contacts=contacts_on_session_clock, facts=facts), clock_fit


def _check_names(source: str | Path, contacts: Sequence[LiveContact], session: Session) -> None:
    """Refuse reports of which none is of two bodies of the session."""
    if any({contact.body_a, contact.body_b} <= session.meshes.keys() for contact in contacts):
        return
    reported = dict.fromkeys(name for contact in contacts for name in (contact.body_a, contact.body_b))
    unknown = [name for name in reported if name not in session.meshes]
    if len(unknown) == len(reported):
        raise AuditError(f"{source} names no body of the session, which has: {', '.join(session.meshes)}; rename them")
    raise AuditError(
        f"{source}: no report is of two bodies of the session: there is no {unknown[0]!r}"
        f"{nearest(unknown[0], session.meshes)}"
    )


def _unit_hint(contacts: Sequence[LiveContact], session: Session) -> str:
    """A sentence where reports last many times as long as the session, as in another unit than seconds, or ``""``."""
    reported = (contacts[-1].time_ns - contacts[0].time_ns) / 1e9
    recorded = float(session.frames.stamp_ns[-1] - session.frames.stamp_ns[0]) / 1e9
    if reported <= MOST_TIMES_LONGER * recorded:
        return ""
    lengths = f"the reports last {duration(reported)}, the session {duration(recorded)}"
    return f"; {lengths}: write seconds, not milliseconds or frames"


def _check_times(source: str | Path, contacts: Sequence[LiveContact], session: Session, hint: str) -> None:
    """Refuse reports before the first frame of which a file can hold no stamp, and those of which none is in time."""
    first, last = int(session.frames.stamp_ns[0]), int(session.frames.stamp_ns[-1])
    earliest, latest = contacts[0].time_ns, contacts[-1].time_ns
    outside = f"{source}: {plural(len(contacts), 'report')}"
    cure = f"check the offset, and that begin and end are not exchanged{hint}"
    if earliest > last:
        raise AuditError(f"{outside}, the first {duration((earliest - last) / 1e9)} after the last frame; {cure}")
    if earliest < 0 or latest < first:
        raise AuditError(f"{outside}, the first {duration((first - earliest) / 1e9)} before the first frame; {cure}")


def _clock_facts(contacts: Iterable[LiveContact], result: RunResult) -> ClockFacts:
    """The steps of both sides, and the offsets of a file on the recording's own clock.

    Its seconds count from the first frame, or are the recording's stamps.
    """
    moments = np.array([contact.time_ns / 1e9 for contact in contacts])
    physics_steps_and_phase = physics_steps([moments], None)
    times = result.assembly.motion.times
    return ClockFacts(
        frame_interval=float(np.median(np.diff(times))) if len(times) > 1 else 0.0,
        physics_step=None if physics_steps_and_phase is None else 1.0 / physics_steps_and_phase[0],
        recording_clock_offsets=(0.0, -result.assembly.first_ns / 1e9),
    )


def _reported_moments(contacts: Iterable[LiveContact]) -> Moments:
    moments: Moments = {}
    for (a, b), spans in reported_spans(contacts).items():
        for span in spans:
            for kind, moment in zip(("begin", "end"), span, strict=True):
                if moment is not None:
                    moments.setdefault((a, b, kind), []).append(moment / 1e9)
    return moments


def _true_moments(result: RunResult) -> Moments:
    """Begins and ends of the true contacts; a contact ends at the first frame without it, as engines report it."""
    moments: Moments = {}
    times = result.assembly.motion.times
    last, ends = len(times) - 1, frame_ends(times)
    for episode in result.episodes["exact"]:
        i, j = result.assembly.pairs[episode.pair].tolist()
        a, b = sorted((result.assembly.names[i], result.assembly.names[j]))
        if episode.first > 0:
            moments.setdefault((a, b, "begin"), []).append(episode.start)
        if episode.last < last:
            moments.setdefault((a, b, "end"), []).append(float(ends[episode.last]))
    return moments
