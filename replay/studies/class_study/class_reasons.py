"""The reason of a class's result: mistakes of detectors that change it or not, few students, unreliable questions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from replay import words
from replay.auditing.fault import Cause
from replay.document.fault_sentences import REASONS
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_tables import ClassTables, Mistakes
from replay.studies.class_study.power import more_students_needed
from replay.studies.class_study.refusals import LEAST_IN_CELL
from replay.studies.class_study.reliability import ACCEPTABLE_ALPHA
from replay.words import plural

MOST_DETECTORS: Final = 3
"""Detectors whose mistakes are counted in a sentence."""

MOST_SCALES: Final = 2
"""Unreliable scales that are named in a sentence."""

CAUSES: Final[Mapping[str, str]] = {
    Cause.BETWEEN_SAMPLES: "the contact, or a part of it, falls between two samples",
    Cause.LATE: "its reports come late",
    Cause.EARLY: "its reports end early",
    **REASONS["misses"],
}
"""Cause -> why a contact is missed, as the end of a sentence; others stand as they are called."""


@dataclass(frozen=True)
class ClassReason:
    """The reason in a sentence, the sentences below it, and what the page folds."""

    text: str
    figures: str = ""
    details: str = ""


def reason(tables: ClassTables, study: Study | None) -> ClassReason:
    """Return why a conclusion changes, or why no association shows; else why contacts are missed."""
    causes = _causes(tables)
    if study is None:
        return ClassReason(" ".join(causes[:1]), " ".join(causes[1:]))
    known = _known_mistakes(tables, study)
    sentences = [f"{label} {_mistakes_text(counts)}." for label, counts in known]
    if study.changing and known:
        (first, counts), *_ = known
        subject = f"{first} leads to another conclusion: it"
        if first not in study.changing:
            subject = f"{first}, which counts here,"
        own = [cause for cause in causes if cause.startswith(f"{first} ")]
        rest = [cause for cause in causes if cause not in own]
        return ClassReason(f"{subject} {_mistakes_text(counts)}.", " ".join([*own, *sentences[1:]]), " ".join(rest))
    answers = [*filter(None, [_hidden_association(study), _unchanged(study, known, tables.runs.titles)])]
    if not answers:
        return ClassReason(" ".join(causes[:1]), " ".join(causes[1:]))
    return ClassReason(answers[0], " ".join(answers[1:]), " ".join([*sentences, *causes]))


def _known_mistakes(tables: ClassTables, study: Study) -> list[tuple[str, Mistakes]]:
    """The mistakes of the detectors that were compared, those first that change a conclusion; empty: none has any."""
    compared = {row.detector for row in study.retested}
    if study.changing:
        compared = set(study.changing)
    if compared:
        compared.add(study.detector)
    counted = {label: tables.mistakes(label) for label in tables.runs.audited if label in compared}
    known = [(label, counts) for label, counts in counted.items() if counts is not None]
    known.sort(key=lambda item: (item[0] not in study.changing, -item[1].wrong))
    return known if any(counts.wrong or counts.false_contacts for _, counts in known) else []


def _hidden_association(study: Study) -> str:
    """Return why an association may not show; ``""``: one shows, or students and questions are good enough."""
    if not study.nothing_associated:
        return ""
    if not study.tested:
        nothing = "the codebook asks for no association that can be tested"
        return f"No test was possible: {study.obstacle.reason if study.obstacle else nothing}."
    reasons = []
    if scales := study.unreliable_scales:
        alphas = ", ".join(words.number(study.reliabilities[scale].alpha, 2) for scale in scales)
        named = " and ".join(scales) if len(scales) <= MOST_SCALES else f"{len(scales)} scales"
        limit = words.number(ACCEPTABLE_ALPHA)
        reasons.append(f"the answers on {named} are unreliable (Cronbach's alpha {alphas}; {limit} is usual)")
    if more_students_needed(study):
        reasons.append(f"{study.students} students are few")
    return f"An association may be hidden: {' and '.join(reasons)}." if reasons else ""


def _unchanged(study: Study, known: list[tuple[str, Mistakes]], titles: Mapping[str, str]) -> str:
    """Return the number of mistakes that changed no conclusion; ``""``: there are none."""
    if not known:
        return ""
    (first, counts), *others = known[:MOST_DETECTORS]
    several = len({counts.contacts for _, counts in known}) > 1
    wrong = [f"{_titled(label, titles)} {own.wrong}{f' of {own.contacts}' if several else ''}" for label, own in others]
    wrong.insert(0, f"{_titled(first, titles)} got {counts.wrong} of {plural(counts.contacts, 'contact')} wrong")
    moved = "moved no result" if study.same_results else "changed no conclusion"
    return f"The detectors' mistakes {moved}: {', '.join(wrong)}."


def _titled(label: str, titles: Mapping[str, str]) -> str:
    """Return the label of a detector and what it is, where that is known."""
    return f"{label} ({titles[label]})" if label in titles else label


def _mistakes_text(counts: Mistakes) -> str:
    """Return the mistakes of a detector by their kind, as the end of a sentence."""
    missed = f"missed {counts.missed} of {plural(counts.contacts, 'contact')}"
    late = f"was late or cut short in {counts.late_or_cut_short}"
    return f"{missed}, {late} and reported {plural(counts.false_contacts, 'false contact')}"


def _causes(tables: ClassTables) -> list[str]:
    """The most frequent cause of the misses of each detector that five students or more have, with its count."""
    counts_of: dict[str, dict[str, float]] = {}
    totals: dict[str, float] = {}
    for (label, cause), counts in tables.counts("misses", "detector", "cause").items():
        totals[label] = totals.get(label, 0.0) + counts.sum()
        if cause and tables.students_with(counts) >= LEAST_IN_CELL:
            counts_of.setdefault(label, {})[cause] = counts.sum()
    sentences = []
    for label, causes in counts_of.items():
        most = max(causes.values())
        for cause in (cause for cause, count in causes.items() if count == most):
            # What is left over could be of few students.
            every = totals[label] == sum(causes.values())
            counted = f"{most:.0f} of {totals[label]:.0f}" if every else "most"
            because = f" because {CAUSES[cause]}" if cause in CAUSES else f": {cause}"
            sentences.append(f"{label} is wrong{because} ({counted} missed or late contacts).")
    return sentences
