"""One thing that the doctor found in a recording; and what every code means and what to do about it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.mcap_format.refusals import CURES


class Severity(IntEnum):
    """How much a finding matters; a gate asks for this much or more."""

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


_EXPORT = "run with --policy to choose what stands in for it, and correct the program that wrote it"
_MEND = "mend it with `replay mesh repair`"
_AGAIN = "export the session again from the program that made it"
_TRACKER = "run with --policy to choose what stands in for it, and look at line of sight and base stations"

NOTE, WARNING, ERROR = Severity

_FINDINGS: Final[dict[str, dict[str, tuple[Severity, str, str]]]] = {
    "structure": {
        "not-mcap": (ERROR, "the file is no MCAP", CURES["not-mcap"]),
        "torn": (ERROR, "the recording was cut short and has no index", CURES["torn"]),
        "unreadable": (ERROR, "the file cannot be walked to its end", CURES["unreadable"]),
        "damaged-chunk": (ERROR, "everything recorded in this chunk is lost to a reader", CURES["damaged-chunk"]),
        "bad-message": (ERROR, "what was recorded is not what its schema says", CURES["bad-message"]),
        "bad-names": (ERROR, "nobody knows which bodies were recorded", CURES["bad-names"]),
        "unlisted-body": (ERROR, "poses of a body that the file does not list", CURES["unlisted-body"]),
        "too-much": (ERROR, "no reader takes so much at once", CURES["too-much"]),
        "damaged-attachment": (ERROR, "a mesh or the scene changed after it was written", CURES["damaged-attachment"]),
        "unknown-version": (ERROR, "this program may misread the file", CURES["unknown-version"]),
        "no-poses": (ERROR, "there is nothing to replay", f"{CURES['no-poses']}, or {CURES['not-mcap']}"),
    },
    "time": {
        "time-backwards": (ERROR, "frames lie before frames already recorded; a run leaves them out", _AGAIN),
        "duplicate-stamps": (
            WARNING,
            "several samples claim one moment; a run keeps the first",
            "check that the recorder stamps each sample",
        ),
        "gap": (
            WARNING,
            "nobody knows what happened in between",
            "do not read contact-free time across it; record at a lower load",
        ),
        "clock-skew": (
            WARNING,
            "the two clocks of this recording disagree; things recorded on one are misplaced on the other",
            "synchronise the clocks and state the offset in the session's facts",
        ),
    },
    "pose": {
        "not-finite": (ERROR, "the sample is no pose", _EXPORT),
        "zero-quaternion": (ERROR, "the sample has no rotation; many engines take it as none", _EXPORT),
        "non-unit-quaternion": (
            ERROR,
            "the rotation is scaled; engines that do not notice stretch the mesh",
            "normalise it in the exporter",
        ),
        "off-unit-quaternion": (NOTE, "the rotation was rounded; a run renormalises it", "export more digits"),
        "out-of-space": (
            ERROR,
            "the position is corrupt: no room holds it",
            "run with --policy to choose what stands in for it, or set `[space] radius_m` in the scene",
        ),
        "identity-while-lost": (
            ERROR,
            "the tracker lost the body and wrote the origin instead, as a valid pose",
            _TRACKER,
        ),
        "tracking-lost": (
            WARNING,
            "the recording says that there is no pose",
            f"{_TRACKER}; at the export, where samples hold no pose",
        ),
        "frozen": (WARNING, "the position stood still because nothing was measured", _TRACKER),
        "teleport": (WARNING, "the body did not get there by moving; the path in between is unknown", _TRACKER),
        "turn-outlier": (
            WARNING,
            "the rotation left and came back faster than a hand turns; what a glass pours then is made up",
            "look at line of sight and base stations",
        ),
    },
    "scale": {
        "unit-suspect": (
            WARNING,
            "positions look like millimetres or centimetres, not metres",
            "import with the right unit",
        ),
        "handedness": (WARNING, "left and right seem to be swapped", "import with the source's handedness"),
        "up-axis": (WARNING, "the head stands upright along another axis than +Y", "import with the source's axes"),
    },
    "mesh": {
        "mesh-hash": (ERROR, "the mesh is not the one that was recorded", "put the recorded mesh back"),
        "mesh-unreadable": (ERROR, "the mesh cannot be used", "export it again as triangles"),
        "mesh-empty": (ERROR, "the mesh has no triangle", "export the surface as triangles"),
        "mesh-degenerate": (WARNING, "faces without area confuse most engines", _MEND),
        "mesh-duplicate": (WARNING, "faces are counted twice", _MEND),
        "mesh-non-manifold": (NOTE, "it has no inside: nothing can be found contained", "repair the edges"),
        "mesh-open": (NOTE, "the surface has holes: nothing can be found inside it", f"if it is solid, {_MEND}"),
        "mesh-winding": (WARNING, "neighbouring faces disagree which side is out", _MEND),
        "mesh-mirrored": (
            ERROR,
            "the mesh is inside out: mirrored, or wound the wrong way",
            f"export it with the right handedness, or {_MEND}",
        ),
        "mesh-units": (WARNING, "its size is not that of a thing on a bench", "set scale in the scene"),
    },
    "stream": {
        "gaze-nowhere": (
            WARNING,
            "the sample says that the eyes were seen, and holds no direction",
            "flag such samples as lost in the export",
        ),
        "stream-apart": (
            WARNING,
            "none of it falls into the time of the poses: its clock is another one",
            "bring it onto the clock of the poses before it is imported",
        ),
        "stream-empty": (WARNING, "nothing was measured", "check the sensor and its column"),
    },
    "scene": {
        "bad-scene": (ERROR, "what was declared cannot be read", "correct the scene"),
        "unknown-frame": (
            ERROR,
            "poses are given in a frame, or for a body, that the file does not know",
            "name it, or leave it out",
        ),
        "unrecorded-body": (WARNING, "it is declared or paired but was never recorded", "record it, or remove it"),
        "no-mesh": (NOTE, "it moves but has no mesh, so no contact of it is found", "give it a mesh"),
        "undeclared-body": (NOTE, "it was recorded but the scene does not speak of it", "declare it"),
        "proxy": (NOTE, "its mesh only stands in for the real one", "say so beside every contact of it"),
    },
}
"""Group -> code -> severity (unless a finding has its own), meaning and fix."""

CODES: Final[dict[str, CodeSpec]] = {
    code: CodeSpec(group, *words) for group, rows in _FINDINGS.items() for code, words in rows.items()
}
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
        """How much it matters here."""
        return CODES[self.code].severity if self.own_severity is None else self.own_severity

    @property
    def meaning(self) -> str:
        """What the finding means for a user of the recording."""
        return CODES[self.code].meaning

    @property
    def fix(self) -> str:
        """What to do about it."""
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
    return sorted(findings, key=lambda one: (-one.severity, order.index(one.code), one.body, one.start_ns or 0))
