"""A detector on the scenes of a case of whole bodies, and whether its answers repeat."""

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from cdcore import Detection, Verdict, create_detector, join
from cdcore.errors import CHOICE_ERRORS, CollisionCoreError
from cdcore.narrow.ill_posed import MarginStage
from cdcore.numerics import BoolArray, ByteArray
from cdcore.protocol import counts_as_contact, is_undecided
from replay.detection.detector_spec import DetectorSpec, SpecLike, parse_detector
from replay.studies.stress.scenes import SCENE_CASES, StressScene, body_pair, meeting_faces, motion_at
from replay.studies.stress.solids import ball_mesh, box_mesh
from replay.studies.stress.tally import Tally, judge_answers

REPEATED_CASE: Final = 43
"""Number of the case that asks whether an answer repeats, whatever the blocks."""

CASE_NAMES: Final = {
    n: name for n, (name, _) in sorted((SCENE_CASES | {REPEATED_CASE: ("repeated answers", None)}).items())
}
"""Number -> name, from 27 on."""

FRAMES_ONLY_REASON: Final = "decides at frames, not between them"


def ask_case(detector: SpecLike, case_number: int, scenes: Sequence[StressScene], *, seed: int, tau: float) -> Tally:
    """Ask a detector one case; ``scenes`` are those of the case, if it has any.

    Raises ``CHOICE_ERRORS``: the detector cannot be made, whatever the bodies.
    """
    spec = parse_detector(detector)
    if case_number == REPEATED_CASE:
        return _ask_repeatedly(spec, seed)
    wrong_counts: Counter[str] = Counter()
    reason_text, is_promised = "", True
    for scene in scenes:
        verdicts, reason, within_promise = _ask_scene(spec, scene, tau)
        wrong_counts.update(verdicts)
        is_promised &= within_promise
        if any(verdicts.get(word) for word in ("missed", "invented", "refused")):
            reason_text = reason_text or reason
    if not is_promised and wrong_counts["missed"]:
        reason_text = reason_text or FRAMES_ONLY_REASON
    questions = sum(len(scene.truth) for scene in scenes)
    return Tally(
        spec.label,
        "case",
        case_number,
        CASE_NAMES[case_number],
        seed,
        questions,
        **dict[str, Any](wrong_counts),
        reason=reason_text,
        promised=is_promised,
    )


def _ask_repeatedly(spec: DetectorSpec, seed: int) -> Tally:
    """One digest for any size of blocks."""
    offsets = np.linspace(-1.3, 1.3, 97)
    motion = motion_at(np.stack([offsets, 0.1 * np.sin(9 * offsets), np.full(97, 0.2)], axis=1))
    sizes = (1, 10, 64, 4096)
    options: dict[str, Any] = {}
    try:
        engine = create_detector(spec.name, body_pair(ball_mesh(0.5), box_mesh()), **spec.settings)
        reference_digest = engine.detect(motion).digest
        differing_sizes = [
            size for size in sizes if join(list(engine.stream(motion.blocks(size)))).digest != reference_digest
        ]
    except CHOICE_ERRORS:
        raise
    except CollisionCoreError as error:
        options = {"refused": len(sizes), "reason": str(error)}
    else:
        if differing_sizes:
            options = {"changed": len(differing_sizes), "reason": f"blocks {differing_sizes[0]}: another digest"}
    return Tally(spec.label, "case", REPEATED_CASE, CASE_NAMES[REPEATED_CASE], seed, len(sizes), **options)


def _ask_scene(spec: DetectorSpec, scene: StressScene, tau: float) -> tuple[dict[str, int], str, bool]:
    """Counts of what a detector says of a scene, why it refused, and whether it promised to decide this."""
    try:
        detections = _detections(spec, scene)
    except CHOICE_ERRORS:
        raise
    except CollisionCoreError as error:
        return {"refused": len(scene.truth)}, str(error), True
    verdict = np.concatenate([detection.verdict[:, 0] for detection in detections])
    reason = next((reason_text for detection in detections for reason_text in detection.reasons.values()), "")
    if scene.covers == "intervals":
        answers = _combine_over_crossings(verdict.reshape(len(scene.truth), -1))
        true_verdicts = scene.truth * np.uint8(Verdict.CONTACT)
        is_promised = detections[0].covers == "intervals"
    else:
        answers, true_verdicts, is_promised = verdict, scene.truth, True
    is_undecided_answer = is_undecided(answers)
    containment_text = (detections[0].containment or ("",))[0]
    if containment_text.startswith("refused: "):
        is_silent = (true_verdicts == Verdict.CONTAINED) & ~counts_as_contact(answers) & ~is_undecided_answer
        reason = containment_text.removeprefix("refused: ") if is_silent.any() else reason
        is_undecided_answer |= is_silent
    wrong_answers = judge_answers(
        answers, true_verdicts, is_undecided_answer, lambda is_wrong: _is_within_tolerance(scene, is_wrong, tau)
    )
    return {word: int(rows.sum()) for word, rows in wrong_answers.items()}, reason, is_promised


def _detections(spec: DetectorSpec, scene: StressScene) -> list[Detection]:
    """One detection, or one a frame where instants are asked of a detector of intervals."""
    engine = create_detector(spec.name, scene.bodies, **spec.settings)
    if scene.covers == "instants" and engine.detect(scene.motion.frames(0, 1)).covers == "intervals":
        return [engine.detect(scene.motion.frames(frame, frame + 1)) for frame in range(len(scene.motion))]
    return [engine.detect(scene.motion)]


def _combine_over_crossings(verdict: ByteArray) -> ByteArray:
    """Combines (crossings, frames) verdicts: a contact anywhere, else undecided anywhere, else clear.

    The first frame of a crossing has no interval before it, so that it has no pose there decides nothing.
    """
    crossing_verdicts = np.full(len(verdict), Verdict.CLEAR, dtype=np.uint8)
    is_open = is_undecided(verdict)
    is_open[:, 0] &= verdict[:, 0] != Verdict.NO_POSE
    crossing_verdicts[is_open.any(axis=1)] = Verdict.UNRESOLVED
    crossing_verdicts[(verdict == Verdict.CANDIDATE).any(axis=1)] = Verdict.CANDIDATE
    crossing_verdicts[(verdict == Verdict.CONTACT).any(axis=1)] = Verdict.CONTACT
    return crossing_verdicts


def _is_within_tolerance(scene: StressScene, is_wrong: BoolArray, tau: float) -> BoolArray:
    """Mask of wrong answers about instants that lie within tau."""
    is_within = np.zeros(len(is_wrong), dtype=np.bool_)
    if scene.covers == "intervals" or tau <= 0 or not is_wrong.any():
        return is_within
    stage = MarginStage(scene.bodies, tau)
    for frame in np.flatnonzero(is_wrong & (scene.truth != Verdict.CONTAINED)).tolist():
        rotation, translations = scene.motion.rotations[frame], scene.motion.translations[frame]
        if scene.truth[frame] == Verdict.CONTACT:
            question = (0, 1), meeting_faces(scene.bodies, scene.motion, frame), rotation, translations
            is_within[frame] = stage.shallow(*question) and stage.loose(*question)
        else:
            is_within[frame] = stage.near((0, 1), rotation[None], translations[None])[0]
    return is_within
