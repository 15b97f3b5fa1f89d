"""What a run gives back: detections, the audit between them, effects, and a summary that JSON can hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdcore import Detection
from replay.affecting import EffectRun
from replay.assembly import Assembly
from replay.audit.causes import Causes
from replay.audit.dwell import Dwell
from replay.audit.face_recall import FaceRecall
from replay.audit.matching import EpisodeMatches
from replay.audit.outcome import Comparison, Episode, Miss
from replay.flags import Flags
from replay.treatment import Treatment
from sessions import Session

if TYPE_CHECKING:
    from replay.tradeoff.trading import Tradeoff


@dataclass(frozen=True, eq=False)
class RunResult:
    """The outcome of ``replay.run``.

    Parameters
    ----------
    session : what was replayed.
    assembly : bodies, motion and pairs that the detectors saw.
    detections : label -> detection, in the order asked for; all on the frames of ``assembly``.
    oracle : label of the detection the others are compared with, or ``""``.
    comparisons : label -> comparison with the oracle.
    episodes : label -> that detection's contact episodes.
    misses : label -> numbered misses, in order of time.
    matches : label -> its episodes matched one to one with the oracle's.
    face_recall : label -> face pairs found, where it was asked for and both list faces of instants.
    causes : label -> why each of its misses was missed.
    dwell : how long each contact of the oracle lasted; ``None`` without an oracle.
    effects : kind -> what the effect found and took, in running order; empty where the scene declares none.
    treatment : what the doctor found, and what the policy made of it.
    flags : which verdicts rest on a pose in doubt.
    summary : settings, seeds, counts, digests, machine; everything JSON can hold.
    tradeoff : what other settings would have missed and taken, where that was measured.
    out : the run folder, or ``None`` when nothing was written.
    """

    session: Session
    assembly: Assembly
    detections: Mapping[str, Detection]
    oracle: str
    comparisons: Mapping[str, Comparison]
    episodes: Mapping[str, tuple[Episode, ...]]
    misses: Mapping[str, tuple[Miss, ...]]
    matches: Mapping[str, EpisodeMatches] = field(default_factory=dict)
    face_recall: Mapping[str, FaceRecall] = field(default_factory=dict)
    causes: Mapping[str, Causes] = field(default_factory=dict)
    dwell: Dwell | None = None
    effects: Mapping[str, EffectRun] = field(default_factory=dict)
    treatment: Treatment | None = None
    flags: Flags | None = None
    summary: Mapping[str, Any] = field(default_factory=dict)
    tradeoff: Tradeoff | None = None
    out: Path | None = None
