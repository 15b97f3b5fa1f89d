"""The reason of a class's result: mistakes of detectors that change it or not, few students, unreliable questions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from replay import words
from replay.auditing.fault import Cause
from replay.document.fault_sentences import CAUSE_REASONS
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

CAUSE_CLAUSES: Final[Mapping[str, str]] = {
    Cause.BETWEEN_SAMPLES: "the contact, or a part of it, falls between two samples",
    Cause.LATE: "its reports come late",
    Cause.EARLY: "its reports end early",
    **CAUSE_REASONS["misses"],
}
"""Cause -> why a contact is missed, as the end of a sentence; others stand as they are called."""


@dataclass(frozen=True)
class ClassReason:
    """The reason in a sentence, the sentences below it, and what the page folds."""

    text: str
    figures: str = ""
    details: str = ""


def reason(class_tables: ClassTables, study: Study | None) -> ClassReason:
    """Return why a conclusion changes, or why no association shows; else why contacts are missed."""
    causes = _causes(class_tables)
    if study is None:
        return ClassReason(" ".join(causes[:1]), " ".join(causes[1:]))
    known_mistakes = _known_mistakes(class_tables, study)
    sentences = [f"{label} {_mistakes_text(counts)}." for label, counts in known_mistakes]
    if study.changing_detectors and known_mistakes:
        return _reason_of_change(study, known_mistakes, causes, sentences)
    answers = [
        *filter(
            None, [_hidden_association(study), _no_change_sentence(study, known_mistakes, class_tables.runs.titles)]
        )
    ]
    if not answers:
        return ClassReason(" ".join(causes[:1]), " ".join(causes[1:]))
    return ClassReason(answers[0], " ".join(answers[1:]), " ".join([*sentences, *causes]))


def _reason_of_change(
    study: Study, known_mistakes: list[tuple[str, Mistakes]], causes: list[str], sentences: list[str]
) -> ClassReason:
    """Return the causes and mistakes of the detectors that change a conclusion; the page folds causes of the others."""
    compared_labels = [label for label, _ in known_mistakes]
    causes_of_compared = [cause for label in compared_labels for cause in causes if cause.startswith(f"{label} ")]
    other_causes = [cause for cause in causes if cause not in causes_of_compared]
    (first_label, first_mistakes), *_ = known_mistakes
    if (
        first_label in study.changing_detectors
        and causes_of_compared
        and causes_of_compared[0].startswith(f"{first_label} ")
    ):
        return ClassReason(
            causes_of_compared[0], " ".join([*causes_of_compared[1:], *sentences]), " ".join(other_causes)
        )
    subject = f"{first_label} leads to another conclusion: it"
    if first_label not in study.changing_detectors:
        subject = f"{first_label}, which counts here,"
    return ClassReason(
        f"{subject} {_mistakes_text(first_mistakes)}.",
        " ".join([*causes_of_compared, *sentences[1:]]),
        " ".join(other_causes),
    )


def _known_mistakes(class_tables: ClassTables, study: Study) -> list[tuple[str, Mistakes]]:
    """The mistakes of the detectors that were compared, those first that change a conclusion; empty: none has any."""
    compared_detectors = {row.detector for row in study.retested_results}
    if study.changing_detectors:
        compared_detectors = set(study.changing_detectors)
    if compared_detectors:
        compared_detectors.add(study.detector)
    mistakes_by_label = {
        label: class_tables.mistakes(label)
        for label in class_tables.runs.audited_detectors
        if label in compared_detectors
    }
    known_mistakes = [(label, counts) for label, counts in mistakes_by_label.items() if counts is not None]
    known_mistakes.sort(key=lambda item: (item[0] not in study.changing_detectors, -item[1].wrong_contacts))
    return known_mistakes if any(counts.wrong_contacts or counts.false_contacts for _, counts in known_mistakes) else []


def _hidden_association(study: Study) -> str:
    """Return why an association may not show; ``""``: one shows, or students and questions are good enough."""
    if not study.nothing_associated:
        return ""
    if not study.tested:
        no_test_text = "the codebook asks for no association that can be tested"
        return f"No test was possible: {study.obstacle.reason if study.obstacle else no_test_text}."
    reasons = []
    if unreliable_scales := study.unreliable_scales:
        alpha_text = ", ".join(words.number(study.reliabilities[scale].alpha, 2) for scale in unreliable_scales)
        scales_text = (
            " and ".join(unreliable_scales)
            if len(unreliable_scales) <= MOST_SCALES
            else f"{len(unreliable_scales)} scales"
        )
        limit_text = words.number(ACCEPTABLE_ALPHA)
        reasons.append(
            f"the answers on {scales_text} are unreliable (Cronbach's alpha {alpha_text}; {limit_text} is usual)"
        )
    if more_students_needed(study):
        reasons.append(f"{study.students} students are few")
    return f"An association may be hidden: {' and '.join(reasons)}." if reasons else ""


def _no_change_sentence(study: Study, known_mistakes: list[tuple[str, Mistakes]], titles: Mapping[str, str]) -> str:
    """Return the number of mistakes that changed no conclusion; ``""``: there are none."""
    if not known_mistakes:
        return ""
    (first_label, first_mistakes), *others = known_mistakes[:MOST_DETECTORS]
    has_several_counts = len({counts.contacts for _, counts in known_mistakes}) > 1
    mistake_texts = [
        f"{_label_with_title(label, titles)} {own.wrong_contacts}{f' of {own.contacts}' if has_several_counts else ''}"
        for label, own in others
    ]
    mistake_texts.insert(
        0,
        f"{_label_with_title(first_label, titles)} got {first_mistakes.wrong_contacts} of "
        f"{plural(first_mistakes.contacts, 'contact')} wrong",
    )
    effect_text = "moved no result" if study.same_results else "changed no conclusion"
    return f"The detectors' mistakes {effect_text}: {', '.join(mistake_texts)}."


def _label_with_title(label: str, titles: Mapping[str, str]) -> str:
    """Return the label of a detector and what it is, where that is known."""
    return f"{label} ({titles[label]})" if label in titles else label


def _mistakes_text(counts: Mistakes) -> str:
    """Return the mistakes of a detector by their kind, as the end of a sentence."""
    missed_text = f"missed {counts.missed} of {plural(counts.contacts, 'contact')}"
    late_text = f"was late or cut short in {counts.late_or_cut_short}"
    false_text = f"reported {plural(counts.false_contacts, 'false contact')}"
    if counts.prolonging:
        which = "all" if counts.prolonging == counts.false_contacts else f"{counts.prolonging:,}"
        false_text += f" ({which} only prolong a true contact)"
    return f"{missed_text}, {late_text} and {false_text}"


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
            is_complete = totals[label] == sum(causes.values())
            count_text = f"{most:.0f} of {totals[label]:.0f}" if is_complete else "most"
            because_text = f" because {CAUSE_CLAUSES[cause]}" if cause in CAUSE_CLAUSES else f": {cause}"
            sentences.append(f"{label} is wrong{because_text} ({count_text} missed or late contacts).")
    return sentences
