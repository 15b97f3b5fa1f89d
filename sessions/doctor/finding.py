"""One thing that the doctor found in a recording; and what every code means and what to do about it."""

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.mcap.refusals import CURES


class Severity(IntEnum):
    """Rank of a finding; a gate fails at a given rank or above."""

    NOTE = 0
    """Worth knowing; no answer changes."""
    WARNING = 1
    """Answers about this body or span are less sure than they look."""
    ERROR = 2
    """Something here is not what was measured; no conclusion should use it."""


@dataclass(frozen=True)
class CodeSpec:
    """The group of a code, how much it matters, what it means for a user of the recording, and what to do about it."""

    group: str
    severity: Severity
    meaning: str
    fix: str


def _specs() -> Iterator[tuple[str, CodeSpec]]:
    table = tomllib.loads(Path(__file__).with_name("findings.toml").read_text("utf-8"))
    cures = CURES | table["cures"]
    for group, rows in table["codes"].items():
        for code, row in rows.items():
            yield code, CodeSpec(group, Severity[row["severity"]], row["meaning"], row["fix"].format_map(cures))


CODES: Final = dict(_specs())
"""Code -> what it means; in the order in which findings of one severity are listed."""


@dataclass(frozen=True)
class Finding:
    """One thing that was found.

    Parameters
    ----------
    code : a name of `CODES`, for example ``frozen``.
    message : one sentence with the figures.
    body : the body or mesh it is about, or ``""`` for the whole recording.
    start_ns, end_ns : first and last frame it covers, by their stamps; ``None`` where it is not about a span.
    start, end : the same in seconds after the first frame.
    count : how many (samples, steps, faces, bytes, ...; the message says of what).
    own_severity : how much it matters here, where that is not as its code says.
    """

    code: str
    message: str
    body: str = ""
    start_ns: int | None = None
    end_ns: int | None = None
    start: float | None = None
    end: float | None = None
    count: int = 1
    own_severity: Severity | None = None

    @property
    def severity(self) -> Severity:
        """The rank of the finding in this session."""
        return CODES[self.code].severity if self.own_severity is None else self.own_severity

    @property
    def meaning(self) -> str:
        """The consequence for a user of the recording."""
        return CODES[self.code].meaning

    @property
    def fix(self) -> str:
        """The repair to make."""
        return CODES[self.code].fix

    def as_json(self) -> dict[str, Any]:
        """Everything, as JSON can hold it."""
        head = {"code": self.code, "severity": self.severity.name.lower(), "body": self.body or None}
        rest = ("start", "end", "start_ns", "end_ns", "count", "message", "meaning", "fix")
        return {**head, **{key: getattr(self, key) for key in rest}}


@dataclass(frozen=True)
class Span:
    """A stretch of the recording by the stamps of its first and last frame, and the stamp that seconds count from."""

    start_ns: int
    end_ns: int
    zero_ns: int

    @classmethod
    def of(cls, stamps: NDArray[np.int64], first: int, last: int) -> "Span":
        """The stretch between two frames of a session."""
        return cls(int(stamps[first]), int(stamps[last]), int(stamps[0]))

    def finding(
        self, code: str, message: str, body: str = "", count: int = 1, severity: Severity | None = None
    ) -> Finding:
        """A finding that covers this stretch."""
        start, end = (self.start_ns - self.zero_ns) / 1e9, (self.end_ns - self.zero_ns) / 1e9
        return Finding(code, message, body, self.start_ns, self.end_ns, start, end, count, severity)


def in_order(findings: Sequence[Finding]) -> list[Finding]:
    """The worst first; then by code, body and start."""
    order = list(CODES)
    return sorted(
        findings,
        key=lambda row: (-row.severity, order.index(row.code), row.body, row.start_ns or 0),
    )
