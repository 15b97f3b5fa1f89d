"""Detectors on the hard cases of whole bodies, from 27 on: passed, missed, invented or refused, with the reason."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore import Detection, Verdict, create_detector
from cdcore.errors import CollisionCoreError
from cdcore.numerics import BoolArray, ByteArray
from cdcore.protocol import counts_as_contact, is_undecided
from replay.base.progress import Progress, Silent
from replay.comparison.tolerance import TAU
from replay.errors import StressError
from replay.studies.stress.attempts import ATTEMPTS
from replay.studies.stress.cases import FailedScene, write_scenes
from replay.studies.stress.effect_cases import EFFECT_CASES, EFFECTS
from replay.studies.stress.families import FIRST_SEED
from replay.studies.stress.found_scenes import SCENES
from replay.studies.stress.peers import PEERS
from replay.studies.stress.scenes import StressScene, meeting

NOT_ASKED: Final = {40: ("time stamps", "about recordings, not detectors: replay info names what lies")}
"""Number of a case that asks no detector -> its name, and why."""

CASES: Final = {n: row[0] for n, row in sorted((SCENES | ATTEMPTS | EFFECT_CASES | NOT_ASKED).items())}
"""Number -> name, from 27 on."""

FIRST, LAST = min(CASES), max(CASES)

AT_FRAMES: Final = "decides at frames: between them it is not asked"
WORDS: Final = ("missed", "invented", "within", "refused", "unconfirmed")
NO_BODIES: Final = "is asked about triangle pairs only"


@dataclass(frozen=True)
class CaseTally:
    """One detector on one case, or the effects."""

    detector: str
    number: int
    name: str
    seed: int
    asked: int = 0  # pair-frames, crossings or attempts
    # missed, invented: wrong by more than tau; an attempt that went wrong counts as missed
    missed: int = 0
    invented: int = 0
    within: int = 0  # wrong about at most tau
    refused: int = 0  # not decided
    unconfirmed: int = 0  # reported by bounding volumes alone where nothing meets
    reason: str = ""  # why it was refused, missed or does not apply
    applies: bool = True  # False where the case asks this detector nothing
    # whether the detector's promise reaches as far as the case: one of instants says nothing of intervals
    promised: bool = True
    file: str | None = None  # where the failing scenes were written, if they were

    @property
    def words(self) -> str:
        """``passed``, ``does not apply``, or what was counted."""
        if not self.applies:
            return "does not apply"
        counts = ((getattr(self, word), word.replace("within", "within tolerance")) for word in WORDS)
        return ", ".join(f"{count:,} {word}" for count, word in counts if count) or "passed"


def cases_of(text: str) -> list[int]:
    """Cases named by ``all``, ``29`` or ``27-28,41``. Raises StressError: not numbers of cases."""
    return numbers_of(f"{FIRST}-{LAST}" if text == "all" else text, "case", FIRST, LAST)


def numbers_of(text: str, what: str, least: int, most: int) -> list[int]:
    """Numbers named by ``9`` or ``3-5,12``. Raises StressError: one is none from ``least`` to ``most``."""
    wanted: set[int] = set()
    for part in text.split(","):
        first, _, last = (word.strip() for word in part.partition("-"))
        ends = first, last or first
        if not (all(map(str.isdecimal, ends)) and least <= int(ends[0]) <= int(ends[1]) <= most):
            raise StressError(f"there is no {what} {part!r}; they go from {least} to {most}, written as 9 or 3-5,12")
        wanted |= set(range(int(ends[0]), int(ends[1]) + 1))
    return sorted(wanted)


def run_cases(
    detectors: Sequence[str],  # names of detectors, or of peers
    cases: Sequence[int] = tuple(CASES),  # their numbers
    *,
    seed: int = FIRST_SEED,  # of the random worlds
    tau: float = TAU,  # metres, see ``TAU``
    out: Path | None = None,  # folder for a file per detector and case with failing scenes; ``None``: none are written
    progress: Progress | None = None,  # told how far the work is
) -> tuple[CaseTally, ...]:
    """Ask each detector each case.

    Returns case after case, detector after detector; cases of effects ask no detector, and once.
    Raises UnknownDetectorError, OutputError.
    """
    found = []
    with (progress or Silent()).stage("cases", len(cases) * len(detectors), "cases") as advance:
        for number in cases:
            if number in EFFECT_CASES:
                found.append(effect_case_of(number, seed))
                advance(len(detectors))
                continue
            scenes = list(SCENES[number][1](np.random.default_rng((seed, number)))) if number in SCENES else []
            for name in detectors:
                found.append(case_of(name, number, scenes, seed=seed, tau=tau, out=out))
                advance(1)
    return tuple(found)


def case_of(
    detector: str, number: int, scenes: Sequence[StressScene], *, seed: int, tau: float, out: Path | None = None
) -> CaseTally:
    """Ask one detector one case; ``scenes`` are those of the case, if it has any."""
    where: dict[str, Any] = {"detector": detector, "number": number, "name": CASES[number], "seed": seed}
    if number in NOT_ASKED or detector in PEERS:
        why = NO_BODIES if detector in PEERS else NOT_ASKED[number][1]
        return CaseTally(**where, reason=why, applies=False)
    if number in ATTEMPTS:
        wrong = [f"{name}: {fault}" for name, fault in _attempted(detector, number) if fault]
        asked = sum(1 for _ in ATTEMPTS[number][1]())
        return CaseTally(**where, asked=asked, missed=len(wrong), reason=wrong[0] if wrong else "")
    answers = [answer_of(detector, scene, tau) for scene in scenes]
    failed = [FailedScene(scene, one.said) for scene, one in zip(scenes, answers, strict=True) if one.failed]
    file = str(write_scenes(failed, detector, number, seed, out)) if out is not None and failed else None
    counts: dict[str, Any] = {word: sum(one.counts[word] for one in answers) for word in WORDS}
    promised = all(one.promised for one in answers)
    reasons = [one.reason for one in answers if one.reason and one.failed]
    reason = reasons[0] if reasons else "" if promised or not counts["missed"] else AT_FRAMES
    asked = sum(len(scene.truth) for scene in scenes)
    return CaseTally(**where, asked=asked, **counts, reason=reason, promised=promised, file=file)


def effect_case_of(number: int, seed: int) -> CaseTally:
    """Ask the models of the effects one case; ``seed`` changes nothing in it."""
    name, ask = EFFECT_CASES[number]
    answers = list(ask())
    wrong = [f"{asked}: {fault}" for asked, fault in answers if fault]
    return CaseTally(EFFECTS, number, name, seed, len(answers), len(wrong), reason=wrong[0] if wrong else "")


def _attempted(detector: str, number: int) -> list[tuple[str, str]]:
    found = []
    for name, attempt in ATTEMPTS[number][1]():
        try:
            found.append((name, attempt(detector)))
        except CollisionCoreError as error:
            found.append((name, str(error)))
    return found


@dataclass(frozen=True, eq=False)
class SceneAnswer:
    """What a detector said of a scene (as long as its truth), and what that is worth."""

    said: ByteArray
    counts: dict[str, int]
    reason: str
    promised: bool

    @property
    def failed(self) -> bool:
        """Whether there is anything to write down."""
        return any(self.counts[word] for word in ("missed", "invented", "refused"))


def answer_of(detector: str, scene: StressScene, tau: float) -> SceneAnswer:
    """Ask a detector about a scene, and count."""
    try:
        detections = _asked(detector, scene)
    except CollisionCoreError as error:
        said = np.full(len(scene.truth), Verdict.INVALID, dtype=np.uint8)
        return SceneAnswer(said, dict.fromkeys(WORDS, 0) | {"refused": len(said)}, str(error), True)
    verdict = np.concatenate([one.verdict[:, 0] for one in detections])
    reason = next((why for one in detections for why in one.reasons.values()), "")
    if scene.covers == "intervals":
        said = _over_crossings(verdict.reshape(len(scene.truth), -1))
        truth = scene.truth * np.uint8(Verdict.CONTACT)
        promised = detections[0].covers == "intervals"
    else:
        said, truth, promised = verdict, scene.truth, True
    refused = is_undecided(said)
    word = (detections[0].containment or ("",))[0]
    if word.startswith("refused: "):
        silent = (truth == Verdict.CONTAINED) & ~counts_as_contact(said) & ~refused
        reason = word.removeprefix("refused: ") if silent.any() else reason
        refused |= silent
    judgement = judged(said, truth, refused, lambda wrong: _within(scene, wrong, tau))
    return SceneAnswer(said, {word: int(rows.sum()) for word, rows in judgement.items()}, reason, promised)


def _asked(detector: str, scene: StressScene) -> list[Detection]:
    """One detection, or one a frame where instants are asked of a detector of intervals."""
    engine = create_detector(detector, scene.bodies)
    first = engine.detect(scene.motion.take(np.array([0])))
    if scene.covers == "instants" and first.covers == "intervals":
        rest = [engine.detect(scene.motion.take(np.array([frame]))) for frame in range(1, len(scene.motion))]
        return [first, *rest]
    return [engine.detect(scene.motion)]


def _over_crossings(verdict: ByteArray) -> ByteArray:
    """What (crossings, frames) verdicts come to: a contact anywhere, else undecided anywhere, else clear.

    The first frame of a crossing has no interval before it, so that it has no pose there decides nothing.
    """
    said = np.full(len(verdict), Verdict.CLEAR, dtype=np.uint8)
    open_ = is_undecided(verdict)
    open_[:, 0] &= verdict[:, 0] != Verdict.NO_POSE
    said[open_.any(axis=1)] = Verdict.UNRESOLVED
    said[(verdict == Verdict.CANDIDATE).any(axis=1)] = Verdict.CANDIDATE
    said[(verdict == Verdict.CONTACT).any(axis=1)] = Verdict.CONTACT
    return said


def judged(
    said: ByteArray, truth: ByteArray, refused: BoolArray, within: Callable[[BoolArray], BoolArray]
) -> dict[str, BoolArray]:
    """By each of ``WORDS``, which of n verdicts (n,) it is said of, beside true ones (n,).

    ``refused`` (n,): not decided; ``within``: which of the wrong ones (n,) are wrong about at most a tolerance.
    """
    unconfirmed = (said == Verdict.CANDIDATE) & (truth != Verdict.CONTACT)
    answer = np.where(said == Verdict.NOT_FOUND, Verdict.CLEAR, said)
    answer[(said == Verdict.CANDIDATE) & (truth == Verdict.CONTACT)] = Verdict.CONTACT
    wrong = (answer != truth) & ~refused & ~unconfirmed
    excused = wrong & within(wrong)
    missed = wrong & ~excused & (truth != Verdict.CLEAR) & ~((truth == Verdict.CONTAINED) & counts_as_contact(said))
    return dict(zip(WORDS, (missed, wrong & ~excused & ~missed, excused, refused, unconfirmed), strict=True))


def _within(scene: StressScene, wrong: BoolArray, tau: float) -> BoolArray:
    """Which wrong answers about instants are about at most tau."""
    within = np.zeros(len(wrong), dtype=np.bool_)
    if scene.covers == "intervals" or tau <= 0 or not wrong.any():
        return within
    from cdcore.narrow.ill_posed import MarginStage

    stage = MarginStage(scene.bodies, tau)
    for frame in np.flatnonzero(wrong & (scene.truth != Verdict.CONTAINED)).tolist():
        turn, move = scene.motion.rotations[frame], scene.motion.translations[frame]
        if scene.truth[frame] == Verdict.CONTACT:
            question = (0, 1), meeting(scene.bodies, scene.motion, frame), turn, move
            within[frame] = stage.shallow(*question) and stage.loose(*question)
        else:
            within[frame] = stage.near((0, 1), turn[None], move[None])[0]
    return within
