"""Limits that a build server holds a detector to; a limit that was not measured counts as broken."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any

from replay.base.wilson import share


@dataclass(frozen=True)
class Gates:
    """What is not to be exceeded; ``None``: not asked for.

    Parameters
    ----------
    max_missed : share of the oracle's contacts never found, and of its pair-frames in contact not reported.
    max_p99_ms : milliseconds within which 99 of 100 frames are decided, of detectors that decide frame by frame.
    """

    max_missed: float | None = None
    max_p99_ms: float | None = None

    def broken(self, audit: Mapping[str, Any], summaries: Sequence[Mapping[str, Any]]) -> list[str]:
        """A sentence for each limit that was exceeded or could not be checked.

        ``audit`` has the figures over all sessions by label; ``summaries`` of the runs hold the times.
        """
        found = [] if self.max_missed is None else _missed(audit, self.max_missed)
        return found + ([] if self.max_p99_ms is None else _late(audit, summaries, self.max_p99_ms))


def _missed(audit: Mapping[str, Any], most: float) -> list[str]:
    if not audit:
        return ["--max-missed cannot be checked: nothing was audited"]
    found = []
    for label, figures in audit.items():
        contacts = share(figures["contacts_missed"], figures["contacts"])
        if not contacts["of"] and not figures["missed"]["of"]:
            found.append(f"--max-missed cannot be checked: there is no contact for {label} to miss")
        for what, part in (("contacts", contacts), ("pair-frames in contact", figures["missed"])):
            if part["of"] and part["share"] > most:
                found.append(
                    f"{label} missed {part['count']} of {part['of']} {what} ({percent(part)}), "
                    f"more than --max-missed {most:g}"
                )
    return found


def _late(audit: Mapping[str, Any], summaries: Sequence[Mapping[str, Any]], most: float) -> list[str]:
    found, timed = [], False
    for summary in summaries:
        for label in audit:
            per_frame = summary["detectors"].get(label, {}).get("seconds", {}).get("per_frame")
            if per_frame is None:
                continue
            timed = True
            if per_frame["p99"] * 1e3 > most:
                found.append(
                    f"{label} takes {per_frame['p99'] * 1e3:.3g} ms at the 99th percentile of the frames of "
                    f"{summary['session']['origin'] or 'the session'}, more than --max-p99-ms {most:g}"
                )
    if not timed:
        found.append("--max-p99-ms cannot be checked: no audited detector decides frame by frame")
    return found


def percent(part: Mapping[str, Any]) -> str:
    """``0.3 % [0.1, 0.6]``: a share and its interval for people."""
    if part["share"] is None:
        return "none"
    share, low, high = (figure(100 * part[name]) for name in ("share", "low", "high"))
    return f"{share} % [{low}, {high}]"


def figure(percentage: float) -> str:
    """Two digits of the distance from 0 or 100, whichever is nearer; no exponent: ``2.6``, ``50``, ``99.98``."""
    away = min(percentage, 100.0 - percentage)
    decimals = max(0, 1 - floor(log10(away))) if away > 0.0 else 0
    text = f"{percentage:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
