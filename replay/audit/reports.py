"""What an engine reported about each pair, as spans: from a begin to the next end."""

from __future__ import annotations

from collections.abc import Iterable

from sessions.live_contact import LiveContact

Span = tuple[int | None, int | None]
"""First and last nanosecond; ``None``: it began before the first report, or nobody said that it ended."""


def reported_spans(contacts: Iterable[LiveContact]) -> dict[tuple[str, str], list[Span]]:
    """Spans per pair of names (sorted), in order of time.

    A second begin within a contact changes nothing, nor does a second end. A pair whose first report is an end, or
    that it stays, was in contact from the start.
    """
    spans: dict[tuple[str, str], list[Span]] = {}
    begun: dict[tuple[str, str], int | None] = {}
    for contact in sorted(contacts, key=lambda one: one.time_ns):
        pair = (min(contact.body_a, contact.body_b), max(contact.body_a, contact.body_b))
        first = pair not in spans
        found = spans.setdefault(pair, [])
        if contact.phase == "exit":
            if pair in begun or first:
                found.append((begun.pop(pair, None), contact.time_ns))
        elif pair not in begun:
            begun[pair] = None if first and contact.phase == "stay" else contact.time_ns
    for pair, start in begun.items():
        spans[pair].append((start, None))
    return spans
