"""The detectors of a run in one order, the worst first: the rows that terminal, page and picture show."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from replay import words
from replay.auditing.loss import fraction_of, loss, lost_contact
from replay.auditing.sampling_offsets import OFFSET_COUNT
from replay.auditing.wilson import Proportion, proportion
from replay.detection.recorded import RECORDED_DETECTOR
from replay.document.answer import FixFigures
from replay.document.audit import CountRange, DetectorAudit
from replay.document.cost import BUDGET_MS
from replay.document.detector_labels import detector_label
from replay.document.run_document import RunDocument
from replay.words import plural

CountBounds = tuple[int, int]
"""Smallest and largest count over the sampling offsets; equal where a detector has no rate."""


@dataclass(frozen=True)
class Rank:
    """Faults and times of one detector, without contacts of a hand with the body that it holds.

    The oracle itself has no shares and no counts.
    """

    label: str  # what the run calls it
    what: str  # what it is, in words: ``convex hulls at 50 Hz``
    setting: str  # the detector with its settings: ``discrete[rate_hz=50]``
    contacts: int  # of the oracle
    mean: float | None  # seconds a frame, over all frames; ``None``: the time of an engine was not measured
    p99: float | None  # seconds in which 99 of 100 of its samples were decided; ``None``: not timed one by one
    missed: Proportion | None = None  # of the contacts, never found
    late_or_cut_short: Proportion | None = None  # of the contacts, found late or cut short
    time_missed: Proportion | None = None  # of the pair-frames in contact, those that it does not report
    missed_counts: CountBounds | None = None  # contacts never found
    late_counts: CountBounds | None = None  # contacts found late or cut short
    false: Proportion | None = None  # of the pair-frames it reports as contact, those that are none
    unconfirmed: bool = False  # whether all of these are candidates: only bounding volumes overlap there
    undecided: int = 0  # contacts that it left undecided
    grasped: tuple[int, int] = (0, 0)  # while a hand holds the body, so not counted: false pair-frames, contacts missed
    phases: int = 1  # sampling offsets that the shares are a mean over, where a rate is audited; 1: this run's

    @property
    def contact_loss(self) -> float:
        """The part of the loss that is contact missed, not reported or left undecided, 0 to 2."""
        return lost_contact(self.missed, self.time_missed, self.undecided / max(1, self.contacts))

    @property
    def loss(self) -> float:
        """The loss that orders the ranking, 0 to 3; 0 of the reference."""
        return loss(self.missed, self.time_missed, self.false, self.undecided / max(1, self.contacts))

    @property
    def lost(self) -> bool:
        """Whether any contact is missed, late or cut short."""
        return fraction_of(self.missed) + fraction_of(self.late_or_cut_short) > 0.0

    @property
    def leads_false(self) -> bool:
        """Whether what it reports falsely is the larger part of its loss."""
        return fraction_of(self.false) > self.contact_loss

    @property
    def of_frame(self) -> float | None:
        """The mean as a share of a frame at the headset's rate."""
        return None if self.mean is None else 1e3 * self.mean / BUDGET_MS


def ranking(document: RunDocument) -> tuple[Rank, ...]:
    """The audited detectors of a run, the one with the largest loss first, and the oracle last.

    Of equal losses the one that misses more contacts comes first. A run computes it once (``RunResult.ranking``), and
    so does a run folder that is read.
    """
    ranks = [_rank(document, label) for label in document.audit]
    ranks.sort(key=lambda rank: (-rank.loss, -fraction_of(rank.missed), -fraction_of(rank.late_or_cut_short)))
    return (*ranks, _without_faults(document, document.oracle, ranks[0].contacts)) if ranks else ()


def _without_faults(document: RunDocument, label: str, contacts: int) -> Rank:
    """Return the label and times of a detector, without faults; the time of an engine was not measured."""
    detector = document.detectors[label]
    measured = detector.name != RECORDED_DETECTOR
    return Rank(
        label=label,
        what=detector_label(detector.name, detector.settings, detector.release),
        setting=detector.spec,
        contacts=contacts,
        mean=detector.seconds.per_frame_mean if measured else None,
        p99=detector.seconds.p99 if measured else None,
    )


def _rank(document: RunDocument, label: str) -> Rank:
    audit = document.audit[label]
    contacts, means = audit.contacts, audit.means_over_offsets
    return replace(
        _without_faults(document, label, contacts),
        missed=means.contacts_missed if means else proportion(audit.contacts_missed, contacts),
        time_missed=means.time_missed if means else audit.time_missed,
        late_or_cut_short=means.late_or_cut_short if means else proportion(audit.late_or_cut_short, contacts),
        missed_counts=count_range(audit.counts_over_offsets.contacts_missed),
        late_counts=count_range(audit.counts_over_offsets.late_or_cut_short),
        false=audit.false_contact_mean,
        unconfirmed=all_unconfirmed(audit),
        undecided=audit.contacts_undecided,
        grasped=(audit.while_grasped.false_contact, audit.while_grasped.contacts_missed),
        phases=OFFSET_COUNT if means else 1,
    )


FIX_LABEL: Final = "fix"
"""Label of the measured Fix in every table, picture and sentence."""


def fixed_rank(rank: Rank, fix_figures: FixFigures, setting: str, document: RunDocument) -> Rank:
    """Return the row of a measured Fix, beside that of the detector it mends."""
    # A command of an earlier run may call one of its detectors so.
    is_taken = FIX_LABEL in document.detectors
    return Rank(
        label=f"{rank.label}+{FIX_LABEL}" if is_taken else FIX_LABEL,
        what=fix_figures.what,
        setting=setting,
        contacts=rank.contacts,
        mean=fix_figures.mean,
        p99=fix_figures.p99,
        missed=fix_figures.missed,
        late_or_cut_short=fix_figures.late_or_cut_short,
        time_missed=fix_figures.time_missed,
        missed_counts=fix_figures.missed_counts,
        late_counts=fix_figures.late_counts,
        false=fix_figures.false,
        phases=fix_figures.offsets,
    )


def ranks_with_fixes(ranks: Sequence[Rank], document: RunDocument) -> list[Rank]:
    """Return the detectors of a run, the measured Fix of the worst one below it."""
    fix_of_label = {answer.label: answer.fix for answer in document.answers[:1]}
    ranks_and_fixes = []
    for rank in ranks:
        fix = fix_of_label.get(rank.label)
        ranks_and_fixes.append(rank)
        if fix is not None and fix.figures is not None:
            ranks_and_fixes.append(fixed_rank(rank, fix.figures, fix.setting, document))
    return ranks_and_fixes


def fix_lane(ranks: Sequence[Rank], document: RunDocument) -> tuple[Rank, FixFigures] | None:
    """Return the measured Fix with the spans of its lane; ``None``: there is no Fix, or its spans were not kept."""
    fix = document.answers[0].fix if document.answers else None
    if fix is None or fix.figures is None or not fix.figures.spans:
        return None
    row = next((row for row in ranks_with_fixes(ranks, document) if row not in ranks), None)
    return None if row is None else (row, fix.figures)


def count_range(counts: CountRange) -> CountBounds:
    """Smallest and largest count over the sampling offsets; this run's where no other was sampled."""
    return counts.smallest, counts.largest


def any_decided(document: RunDocument) -> bool:
    """Whether reference and detector, of any detector, decided any pair-frame together."""
    return any(audit.pair_frames.compared for audit in document.audit.values())


def all_unconfirmed(audit: DetectorAudit) -> bool:
    """Whether every false pair-frame of an audited detector is a candidate, which nobody confirmed on triangles."""
    return audit.unconfirmed > 0 and audit.unconfirmed == audit.pair_frames.false_contact


def false_text(proportion_false: Proportion | None, unconfirmed: bool, possessive: str) -> str:
    """Return the fraction of reported contact time that is false, or ``unconfirmed``; ``""``: nothing.

    Every pair-frame counts alike: it is a share of time as far as frames are evenly spaced.
    """
    false_fraction = fraction_of(proportion_false)
    if not false_fraction:
        return ""
    false_word = "unconfirmed: only bounding volumes overlap" if unconfirmed else "false"
    return f"{words.as_percentage(false_fraction)} of {possessive} contact time is {false_word}"


def misses_text(missed_range: CountBounds, late_range: CountBounds, contacts: int) -> str:
    """``up to 2 of 18 contacts missed, 5 to 9 late or cut short``; ``""``: none of both."""
    clauses = []
    contacts_text = plural(contacts, "contact")
    if missed_range[1]:
        clauses.append(f"{words.count_words(missed_range)} of {contacts_text} missed")
        contacts_text = ""
    if late_range[1]:
        of_contacts = f" of {contacts_text}" if contacts_text else ""
        clauses.append(f"{words.count_words(late_range)}{of_contacts} late or cut short")
    return ", ".join(clauses)


def fault_text(rank: Rank, *, largest: bool = False, possessive: str = "its") -> str:
    """Return the faults of a detector, the larger one first; follows its label, fit for a title.

    ``largest``: that fault alone; ``possessive`` the contact time is, that is false.
    """
    texts = _fault_texts(rank, possessive)
    if texts:
        return texts[0] if largest else "; ".join(texts)
    return f"no contact of {rank.contacts} missed, none false" if rank.contacts else NO_FAULTS_TEXT


def lesser_faults(rank: Rank) -> str:
    """Return sentences about the faults of a detector but the first of ``fault_text``; ``""``: there are none."""
    false_clause, misses_sentence = false_text(rank.false, rank.unconfirmed, f"{rank.label}'s"), _misses_sentence(rank)
    false_sentence = f"{false_clause}." if false_clause else ""
    texts = [
        text
        for text in ([false_sentence, misses_sentence] if rank.leads_false else [misses_sentence, false_sentence])
        if text
    ]
    return " ".join(texts if rank.undecided else texts[1:])


def _misses_sentence(rank: Rank) -> str:
    """``hull50 misses up to 1 of 18 contacts; 1 to 3 are late or cut short.``; ``""``: none of both."""
    missed, late = rank.missed_counts or (0, 0), rank.late_counts or (0, 0)
    contacts, verb = plural(rank.contacts, "contact"), "is" if late[1] == 1 else "are"
    short = f"{words.count_words(late)} {verb} late or cut short"
    if missed[1]:
        rest = f"; {short}" if late[1] else ""
        return f"{rank.label} misses {words.count_words(missed)} of {contacts}{rest}."
    if late[1]:
        return f"{rank.label} reports {words.count_words(late)} of {contacts} late or cut short."
    return ""


def _fault_texts(rank: Rank, possessive: str) -> list[str]:
    lost_contacts = misses_text(rank.missed_counts or (0, 0), rank.late_counts or (0, 0), rank.contacts)
    undecided_clause = f"{rank.undecided} of {plural(rank.contacts, 'contact')} undecided" if rank.undecided else ""
    weighted_clauses = [
        (2.0, undecided_clause),
        (rank.contact_loss, lost_contacts),
        (fraction_of(rank.false), false_text(rank.false, rank.unconfirmed, possessive)),
    ]
    return [text for _, text in sorted(weighted_clauses, key=lambda entry: -entry[0]) if text]


NO_FAULTS_TEXT: Final = "no contact to miss, and none false"
