"""Everything that decides a run: one frozen object, made by command line and Python alike, printed whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

import numpy as np

from cdcore.tolerances import TWO_MICROMETRES
from replay.detection.detector_spec import (
    RELEASE_SETTING,
    TRUSTED_DETECTOR,
    DetectorSpec,
    SpecLike,
    SpecsLike,
    parse_detector,
    parse_detectors,
)
from replay.detection.recorded import RECORDED_DETECTOR
from replay.errors import DetectorSpecError
from replay.prepare.assemble import Pairs
from replay.prepare.noise import DEFAULT_COPIES
from replay.prepare.policy import Policy, PolicyLike, parse_policy
from sessions import Session

NO_ORACLE: Final = "none"

STEP_RATE_HZ: Final = 50.0
"""Hertz: the fixed step that Unity has unless somebody changes it."""


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings of a run: detectors, the part of a recording, and how answers are judged.

    Parameters
    ----------
    detectors : ``"hybrid"``, ``"slow=discrete[rate_hz=22.5]"``, ``("discrete", {"rate_hz": 22.5})``, several in a
        sequence, or a mapping from label to one; ``()``: effects only; ``None``: those of ``usual_detectors``, if the
        scene's plan looks for contacts at all.
    oracle : the detector to trust: a label among ``detectors`` or one of its own; ``None``: ``exact``; ``"none"``: no
        audit.
    step_rate : hertz of the engine's physics, for the detectors asked unasked.
    pairs : pairs of body names; ``None``: the scene's, else all that move against each other.
    start, end : seconds after the first frame.
    policy : what is done with poses in doubt: ``["frozen=drop", "tracking-lost=interpolate:0.2"]`` or a mapping;
        ``None``: the defaults of ``replay.prepare.policy``.
    noise : ``"vive"`` or ``"0.3 mm, 0.05 deg, 0.1 s"``, of one body ``"beaker=vive"``, or several: ask
        ``noise_copies`` noisy copies of the recording which contacts of the oracle hold in spite of it.
    seed : of every random stream.
    tau : metres; a disagreement about less is *within tolerance*.
    offline : hand every detector the whole motion at once, also those that can be asked frame by frame.
    fix_time : seconds in which the Fix of colliders may be measured, after everything else; 0: it is not.

    Raises ``DetectorSpecError``: a step rate that is no positive number.
    """

    detectors: SpecsLike | None = None
    oracle: SpecLike | None = None
    step_rate: float = STEP_RATE_HZ
    pairs: Pairs | None = None
    start: float | None = None
    end: float | None = None
    policy: PolicyLike | Policy | None = None
    noise: Sequence[str] | str = ()
    noise_copies: int = DEFAULT_COPIES
    seed: int = 0
    tau: float = TWO_MICROMETRES
    offline: bool = False
    fix_time: float = 0.0

    def __post_init__(self) -> None:
        if not (isfinite(self.fix_time) and self.fix_time >= 0.0):
            raise DetectorSpecError(f"the time for a fix is {self.fix_time}; give seconds, 0 for none")
        if not (isfinite(self.step_rate) and self.step_rate > 0.0):
            raise DetectorSpecError(f"the step rate is {self.step_rate}; give steps a second, like 50")

    @property
    def noises(self) -> tuple[str, ...]:
        """The sizes of noise asked for, none, one or several."""
        return (self.noise,) if isinstance(self.noise, str) else tuple(self.noise)

    def as_json(self, lineup: Lineup) -> dict[str, Any]:
        """Every setting as plain data, with the detectors and the oracle that they came to."""
        return vars(self) | {
            "detectors": [str(spec) for spec in lineup.specs],
            "oracle": lineup.oracle or NO_ORACLE,
            "pairs": None if self.pairs is None else [list(pair) for pair in self.pairs],
            "policy": parse_policy(self.policy).as_json(),
            "noise": list(self.noises),
        }


@dataclass(frozen=True)
class Lineup:
    """Every detector of a run, the oracle among them, and the oracle's label or ``""``; labels to be asked ``live``."""

    specs: tuple[DetectorSpec, ...] = ()
    oracle: str = ""
    live: frozenset[str] = frozenset()


def line_up(settings: RunSettings, session: Session) -> Lineup:
    """Settle which detectors run, and which of them is the oracle.

    All are asked live, the oracle too, whether it was named or not: it is timed as those beside it. Raises
    ``DetectorSpecError``: words that name no detector.
    """
    if settings.detectors is None:
        specs = usual_detectors(session, settings.step_rate)
    else:
        specs = parse_detectors(settings.detectors)
    if not specs:
        return Lineup()
    labels = frozenset(spec.label for spec in specs)
    if settings.oracle == NO_ORACLE:
        return Lineup(specs, "", labels)
    trusted = parse_detector(TRUSTED_DETECTOR if settings.oracle is None else settings.oracle)
    for spec in specs:
        if spec.label == trusted.name and not trusted.settings:
            trusted = spec
        if trusted.release:
            raise DetectorSpecError(
                f"the reference has no release distance; leave {RELEASE_SETTING} out of {trusted.label!r}"
            )
        if (spec.name, dict(spec.settings), spec.release) == (trusted.name, dict(trusted.settings), 0.0):
            # Alone there is nothing to compare its time with.
            return Lineup(specs, spec.label, labels if len(specs) > 1 else frozenset())
    if trusted.label in labels:
        raise DetectorSpecError(
            f"the reference and a detector are both called {trusted.label!r}; write oracle=... with a label"
        )
    return Lineup((*specs, trusted), trusted.label, labels | {trusted.label})


def usual_detectors(session: Session, step_rate: float) -> tuple[DetectorSpec, ...]:
    """Return the default detectors, at an engine's step rate.

    The reports that an engine recorded, if there are any; the colliders recorded with the bodies or else convex hulls,
    and the meshes, at the step rate; the paper's pipeline; and every triangle of every frame.
    """
    collider = "shipped" if any(session.colliders.values()) else "hull"
    rate = np.format_float_positional(step_rate, trim="-")
    names = [f"{collider}{rate}", f"mesh{rate}", "paper", TRUSTED_DETECTOR]
    if has_reports(session):
        names.insert(0, RECORDED_DETECTOR)
    return parse_detectors(names)


def has_reports(session: Session) -> bool:
    """Whether the recording holds what an engine reported about bodies that can be looked at."""
    return any(session.meshes.keys() >= {report.body_a, report.body_b} for report in session.live_contacts)
