"""Faults on the page of a run: which come first, and the text of their cards."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from typing import Final

from replay import words
from replay.auditing.fault import Cause, Fault, worst_first
from replay.document.depth import depth_text
from replay.show.palette import fault_key
from replay.show.report.charts import KIND_LABELS, Lane, lane
from replay.show.report.markup import moment_address
from replay.show.report.run_view import Pair, RunView, spans
from replay.show.report.still import CARD_SIZE, FIRST_SIZE
from replay.words import plural

MARGIN_FRACTION: Final = 0.35
"""Fraction of a fault that its lane shows before and after it."""

LEAST_MARGIN_S: Final = 0.1
"""Seconds."""

MOST_LISTED_FAULTS: Final = 2000
"""Faults of a pair, or of all pairs without a card, that are listed; the tables hold all."""

MOST_PAIRS: Final = 6
"""Cards of a detector; further pairs are folded."""


@dataclass(frozen=True)
class Card:
    """A fault as text; picture and lanes where it has a card of its own.

    Parameters
    ----------
    key : kind of a lane, which has a colour: ``missed``, ``late`` or ``false``.
    title : what and which number: ``Late contact 2``.
    size : length of the intersection curve or of the gap, ``""`` where it was not measured.
    contact : number of the missed contact of the reference; 0: the fault is a false contact.
    bodies : ``a and b``.
    span : ``19.344 to 22.056 s``.
    picture, colours : picture as HTML, and its colours in words.
    lanes : name and lane of the reference and of the detector around the fault.
    """

    key: str
    title: str
    bodies: str
    span: str
    start: float
    end: float
    frames: int
    kind: str
    cause: str
    size: str
    contact: int
    why: str
    address: str
    command: str
    picture: str = ""
    colours: str = ""
    lanes: Sequence[tuple[str, Lane]] = ()


def cards(view: RunView, label: str) -> list[list[Card]]:
    """Return the faults of each pair, the worst first; before all else the fault that the answer is about."""
    moment = next(answer.moment for answer in view.answers if answer.label == label)
    faults = worst_first(view.faults.get(label, ()))
    if moment is not None:
        faults_of_kind = [fault for fault in faults if fault.kind.category == moment.kind]
        leading_faults = [fault for fault in faults_of_kind if fault.number == moment.number]
        other_faults = [fault for fault in faults_of_kind if fault.number != moment.number]
        faults = [*leading_faults, *other_faults, *(fault for fault in faults if fault.kind.category != moment.kind)]
    groups: dict[Pair, list[Card]] = {}
    for fault in faults:
        faults_of_pair = groups.setdefault(fault.bodies, [])
        faults_of_pair.append(card(view, fault, with_picture=not faults_of_pair and len(groups) <= MOST_PAIRS))
    return [*groups.values()]


def card(view: RunView, fault: Fault, *, with_picture: bool = True, is_first_picture: bool = False) -> Card:
    """Return a fault as text; with lanes and picture or not; ``is_first_picture``: with the large one of a page."""
    is_first_detector = fault.detector == next(iter(view.document.audit))
    noise = f" With tracker noise: {fault.noise}." if fault.noise else ""
    detector_option = f" --by {fault.detector}" if len(view.answers) > 1 else ""
    picture, colours = "", ""
    if with_picture and view.still is not None:
        picture, colours = view.still(fault.detector, fault, FIRST_SIZE if is_first_picture else CARD_SIZE)
    return Card(
        key=fault_key(fault.kind),
        title=f"{fault.name.capitalize()} {fault.number}",
        bodies=" and ".join(fault.bodies),
        span=f"{words.timestamp(fault.start)} to {words.moment(fault.end)}",
        start=fault.start,
        end=fault.end,
        frames=fault.frames,
        kind=fault.kind.value,
        cause=fault.cause.value,
        size=_size_text(fault.depth, fault.metres, at_least=fault.depth_at_least, is_miss=fault.kind.is_miss),
        contact=fault.contact,
        why=f"{fault.why or fault.cause}{noise}",
        address=moment_address(fault.kind.category.value, fault.number, "" if is_first_detector else fault.detector),
        command=f"replay view {view.folder} --{fault.kind.category} {fault.number}{detector_option}",
        picture=picture,
        colours=colours,
        lanes=_lanes(view, fault) if with_picture and not is_first_picture else (),
    )


def _size_text(depth: float, metres: float, *, at_least: bool, is_miss: bool) -> str:
    """Return the depth of a miss, or the length of its curve where that is unknown, or the gap of a false contact."""
    if depth_phrase := depth_text(depth, at_least=at_least):
        return depth_phrase
    if isnan(metres):
        return ""
    return f"{words.length(metres)} {'curve of intersection' if is_miss else 'apart'}"


def _lanes(view: RunView, fault: Fault) -> list[tuple[str, Lane]]:
    """The reference above the detector, around a fault of one pair."""
    margin_s = max(MARGIN_FRACTION * (fault.end - fault.start), LEAST_MARGIN_S)
    window = fault.start - margin_s, fault.end + margin_s
    return [
        (
            name,
            lane(
                spans(view, name, fault.bodies),
                window,
                f"{name} from {words.timestamp(window[0])} to {words.moment(window[1])}",
            ),
        )
        for name in (view.oracle, fault.detector)
    ]


def first_fault(view: RunView) -> Card | None:
    """Return the fault that the first answer of a page is about, with its large picture; ``None``: it is about none."""
    answer = view.answers[0]
    if answer.moment is None:
        return None
    kind_and_number = answer.moment.kind, answer.moment.number
    faults = view.faults[answer.label]
    fault = next((fault for fault in faults if (fault.kind.category, fault.number) == kind_and_number), None)
    return None if fault is None else card(view, fault, is_first_picture=True)


def fault_counts(view: RunView, label: str) -> str:
    """Return how many faults of each kind a detector has, of how many of all detectors: ``23 of the 43 faults ...``."""
    faults = view.faults.get(label, ())
    fault_count = sum(map(len, view.faults.values()))
    count_of_kind = Counter(fault_key(fault.kind) for fault in faults)
    is_confirmed = any(not fault.kind.is_miss and fault.cause is not Cause.BOUNDING_VOLUMES for fault in faults)
    count_texts = []
    if count_of_kind["false"]:
        count_texts.append(plural(count_of_kind["false"], "false contact" if is_confirmed else "unconfirmed contact"))
    count_texts += [f"{count_of_kind[kind]} {KIND_LABELS[kind]}" for kind in ("missed", "late") if count_of_kind[kind]]
    of_all_text = (
        f" of the {fault_count:,} faults of this run"
        if fault_count > len(faults)
        else f" {'fault' if fault_count == 1 else 'faults'}"
    )
    phase_count = next(rank for rank in view.ranking if rank.label == label).phases
    moments_note = (
        " Moments are those of the start time of sampling whose counts are nearest the mean." if phase_count > 1 else ""
    )
    numbers_note = " Missed and late contacts share their numbers, which --miss takes." if count_of_kind["late"] else ""
    return f"{len(faults):,}{of_all_text}: {', '.join(count_texts)}.{numbers_note}{moments_note}"
