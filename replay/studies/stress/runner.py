"""Detectors over the families of triangle pairs and over the cases of whole bodies."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore import Verdict
from cdcore.detectors.detector_table import detector_names, detector_row, settings_of
from cdcore.narrow.margins import triangle_margins
from cdcore.numerics import BoolArray, ByteArray, FloatArray
from cdcore.protocol import is_undecided
from cdcore.tolerances import TWO_MICROMETRES
from cdcore.triangles.integers import pair_intersects_integers
from replay.detection.detector_spec import DetectorSpec, parse_detector, split_specs
from replay.detection.progress import Progress, Silent
from replay.errors import OutputError, StressError
from replay.studies.stress.bodies import ask_case
from replay.studies.stress.families import FAMILIES, FIRST_SEED, Family
from replay.studies.stress.scenes import scenes_of
from replay.studies.stress.tally import StressResult, Tally, judge_answers
from replay.studies.stress.triangle_pairs import verdicts_of
from sessions.whole_files import whole_file

ALL_DETECTORS: Final = "all"


def detectors_of(text: str) -> list[DetectorSpec]:
    """The detectors that ``--detectors`` means: specs with commas between them, or ``all``; each once.

    Raises StressError: no detector. Raises DetectorSpecError: text of another form. Raises UnknownDetectorError: lists
    the names there are. Raises InvalidSettingError: a setting that the detector does not have.
    """
    chosen_detectors: dict[str, DetectorSpec] = {}
    for spec in split_specs(str(text)):
        detector_rows = (
            [name for name in detector_names() if not detector_row(name).no_triangles]
            if spec.strip() == ALL_DETECTORS
            else [spec]
        )
        for row in detector_rows:
            detector = parse_detector(row)
            settings_of(detector.name, detector.settings)
            chosen_detectors.setdefault(detector.label, detector)
    if not chosen_detectors:
        raise StressError(f"{text!r} names no detector; there are: {', '.join(detector_names())}, {ALL_DETECTORS}")
    return list(chosen_detectors.values())


def numbers_of(numbers_text: str | None, numbered_thing: str, known_numbers: Sequence[int]) -> list[int]:
    """Numbers named by ``9``, ``3-5,12`` or ``all``; of ``None`` none. Raises StressError: one is not known.

    Examples
    --------
    >>> numbers_of("3-5,12", "family", range(1, 27))
    [3, 4, 5, 12]
    """
    if numbers_text is None:
        return []
    if numbers_text == ALL_DETECTORS:
        return [*known_numbers]
    chosen_numbers: set[int] = set()
    smallest_number, largest_number = min(known_numbers), max(known_numbers)
    for entry in numbers_text.split(","):
        first, _, last = (word.strip() for word in entry.partition("-"))
        range_ends = first, last or first
        is_in_range = (
            all(map(str.isdecimal, range_ends))
            and smallest_number <= int(range_ends[0]) <= int(range_ends[1]) <= largest_number
        )
        numbers = {
            number for number in known_numbers if is_in_range and int(range_ends[0]) <= number <= int(range_ends[1])
        }
        if not numbers:
            raise StressError(
                f"there is no {numbered_thing} {entry!r}; they go from {smallest_number} to {largest_number}, "
                f"written as 9 or 3-5,12"
            )
        chosen_numbers |= numbers
    return sorted(chosen_numbers)


def stress(
    detector: str = ALL_DETECTORS,  # specs of detectors, with commas between them, or ``"all"``
    *,
    families: Sequence[Family] = FAMILIES,
    cases: Sequence[int] = (),  # numbers of cases of whole bodies
    pairs: int = 4000,  # how many of each family
    seed: int = FIRST_SEED,  # of the first family; family k takes this plus k - 1
    tau: float = TWO_MICROMETRES,  # metres, see ``TWO_MICROMETRES``
    out: Path | None = None,  # folder for a file per detector and family that failed; ``None``: none are written
    progress: Progress | None = None,
) -> StressResult:
    """Ask detectors about hard triangle pairs and bodies whose answer is known.

    The truth of triangle pairs is the integer test, which shares no step with the filter and the sums that ``exact``
    decides by. Raises StressError, OutputError, and ``CHOICE_ERRORS``: a detector cannot be made.
    """
    detectors = detectors_of(detector)
    labels = [spec.label for spec in detectors]
    if pairs < 1 or seed < 0 or not 0 <= tau < float("inf"):
        arguments_text = f"{pairs} pairs, seed {seed}, tau {tau}"
        raise StressError(f"{arguments_text}: give 1 pair or more, and neither seed nor tau below 0")
    tallies: list[Tally] = []
    with (progress or Silent()).stage("stress", len(detectors) * (len(families) + len(cases)), "questions") as advance:
        for family in families:
            triangles = family.pairs(pairs, seed)
            truth = np.array([pair_intersects_integers(pair.tolist()) for pair in triangles], dtype=np.bool_)
            for spec in detectors:
                verdicts = verdicts_of(spec, triangles)
                tallies.append(family_tally(spec.label, family, seed, triangles, truth, verdicts, tau, out))
                advance(1)
        tallies.sort(key=lambda tally: labels.index(tally.detector))
        for number in cases:
            scenes = scenes_of(number, seed)
            for spec in detectors:
                tallies.append(ask_case(spec, number, scenes, seed=seed, tau=tau))
                advance(1)
    return StressResult(seed, pairs, tau, tuple(tallies))


def family_tally(
    detector: str,
    family: Family,
    seed: int,
    triangles: FloatArray,
    truth: BoolArray,
    verdict: ByteArray,
    tau: float,
    out: Path | None = None,
) -> Tally:
    """Count what verdicts (n,) of pairs (n, 2, 3, 3) of a family are worth beside the truth (n,).

    Pairs that failed are written to a file in ``out``, ``family-09-hybrid-seed-100.npz``.
    """

    def is_within_tolerance(is_wrong: BoolArray) -> BoolArray:
        # With a tolerance of 0 none is, not even a touch.
        is_within = is_wrong & family.metric & (tau > 0)
        is_within[is_within] = triangle_margins(triangles[is_within])[1] <= tau
        return is_within

    answers = judge_answers(verdict, truth * np.uint8(Verdict.CONTACT), is_undecided(verdict), is_within_tolerance)
    answer_counts: dict[str, Any] = {word: int(rows.sum()) for word, rows in answers.items()}
    wrong_rows = np.flatnonzero(answers["missed"] | answers["invented"] | answers["refused"])
    target = None
    if out is not None and len(wrong_rows):
        file_stem = re.sub("[^a-z0-9]+", "-", detector.lower())
        target = str(out / f"family-{family.number:02d}-{file_stem}-seed-{seed}.npz")
        with whole_file(Path(target), OutputError, parents=True) as file:
            np.savez_compressed(
                file,
                row=wrong_rows,
                triangles=triangles[wrong_rows],
                truth=truth[wrong_rows],
                verdict=verdict[wrong_rows],
                family=family.number,
                seed=seed,
                count=len(triangles),
                detector=detector,
            )
    return Tally(detector, "family", family.number, family.name, seed, len(triangles), **answer_counts, file=target)
