"""The first answers about a class: the result, where to look, its reason, what to do, the cost, how sure."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from replay import words
from replay.document.columns import checked_column_names
from replay.document.tables import Marked
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_reasons import reason
from replay.studies.class_study.class_tables import ClassTables, PageLink, sessions_table
from replay.studies.class_study.power import (
    MEDIUM_CORRELATION,
    least_correlation,
    more_students_needed,
    students_needed,
    tests_together,
)
from replay.studies.class_study.refusals import LEAST_IN_CELL, LEAST_STUDENTS, count_text
from replay.studies.class_study.regression import SIGNIFICANCE_LEVEL, Finding
from replay.studies.class_study.tables import (
    families_text,
    headlines,
    p_relation,
    result_name,
    source_sentence,
    undecided_text,
)
from replay.words import joined_names, plural

MOST_SESSIONS: Final = 3
"""Sessions that are named on the first screen; the table below has the others."""

FIRST_SESSIONS_SENTENCE: Final = (
    "These are among the sessions with most missed or late contacts; each link opens the one where the surfaces "
    "intersect most."
)

MOST_RESULTS: Final = 3
"""Results that are named there."""

MOST_REFUSED: Final = 2
"""Results left out that are named there."""

MOST_SCALES: Final = 2
"""Unreliable scales that are named there."""

QUESTIONNAIRE_HINT: Final = "To test conclusions, add --questionnaire answers.csv --codebook codebook.yaml."

FRAMES_A_SECOND: Final = 90.0
"""Frames of a headset, by which the time of a class is estimated."""

DETECTOR, MEAN_MS = checked_column_names("metrics", "detector", "mean_ms")
"""Column of the metrics with the milliseconds of a detector a frame."""


@dataclass(frozen=True)
class AnswerRow:
    """A heading with its texts, as ``replay.document.answer.Reason`` has them.

    Parameters
    ----------
    name : the heading.
    text : the answer itself, one short sentence.
    figures : the sentences below it; ``""``: none.
    links : texts and addresses of what it leads to, behind ``text``.
    details : what the page folds and a terminal prints with ``-v``; ``""``: nothing.
    """

    name: str
    text: str
    figures: str = ""
    links: tuple[tuple[str, str], ...] = ()
    details: str = ""


def class_answer(class_tables: ClassTables, addresses: Mapping[str, PageLink], study: Study | None) -> list[AnswerRow]:
    """Return the rows below the first sentence of a class; a row without text or links is left out."""
    result, *other_results = [*_with_other_detectors(study), *_result_sentences(study)]
    figures = [*other_results, _names_of_detectors(class_tables), class_tables.rate_difference()]
    class_reason = reason(class_tables, study)
    seconds_of_detector = _mean_times(class_tables)
    answer_rows = [
        AnswerRow(
            "What",
            result,
            " ".join(filter(None, figures)),
            details=" ".join(class_tables.headlines()),
        ),
        _first_sessions(class_tables, addresses, study),
        AnswerRow("Why", class_reason.text, class_reason.figures, details=class_reason.details),
        AnswerRow("Do", *_first_and_rest(_action_sentences(class_tables, study))),
        AnswerRow("Cost", *_first_and_rest(_cost_sentences(class_tables, study, seconds_of_detector))),
        AnswerRow(
            "Or",
            *_first_and_rest(_quicker_detector_sentences(study, class_tables.trusted_detectors, seconds_of_detector)),
        ),
        _certainty_row(class_tables, study),
    ]
    return [row for row in answer_rows if row.text and (row.name != "When" or row.links)]


def _first_and_rest(sentences: list[str]) -> tuple[str, str]:
    """The first sentence, and the others as one text."""
    return sentences[0] if sentences else "", " ".join(sentences[1:])


def _result_sentences(study: Study | None) -> list[str]:
    """The associations, most pronounced first; else the undecided results, and their definition."""
    if study is None:
        return ["Nothing was tested: there is no questionnaire."]
    headline_sentences = headlines(study)
    more_sentence = (
        [f"{len(headline_sentences) - MOST_RESULTS} more below."] if len(headline_sentences) > MOST_RESULTS else []
    )
    definition_sentences = [undecided_text(study), families_text(study)] if study.nothing_associated else []
    return [*(f"{sentence}." for sentence in headline_sentences[:MOST_RESULTS]), *more_sentence, *definition_sentences]


def _with_other_detectors(study: Study | None) -> list[str]:
    """Sentences on the results that are others with another detector, each with both figures; none: all stay."""
    if study is None:
        return []
    changes: dict[tuple[str, float, bool], list[tuple[str, float]]] = {}
    for row in study.retested_results:
        if row.changes and row.after is not None:
            is_reversed = row.before.beta * row.after.beta < 0.0
            change = (result_name(row.before), row.before.beta, is_reversed)
            changes.setdefault(change, []).append((row.detector, row.after.beta))
    sentences = []
    for (name, beta, is_reversed), results in changes.items():
        labels = [label for label, _ in results]
        verb = "reverse the sign of a result" if is_reversed else "change a conclusion"
        if len(labels) == 1:
            verb = "reverses the sign of a result" if is_reversed else "changes a conclusion"
        labels_of_figure: dict[str, list[str]] = {}
        for label, other_beta in results:
            labels_of_figure.setdefault(f"{other_beta:+.2f}", []).append(label)
        figures = ", ".join(f"{figure} with {joined_names(own)}" for figure, own in labels_of_figure.items())
        sentences.append(f"{joined_names(labels)} {verb}: {name} is {figures}, {beta:+.2f} with {study.detector}.")
    return sentences


def _names_of_detectors(tables: ClassTables) -> str:
    """Return what each detector is: ``exact: every triangle, every frame; hull50: convex hulls at 50 Hz.``"""
    titles = tables.runs.titles
    labels = [label for label in (*tables.trusted_detectors, *tables.runs.audited_detectors) if label in titles]
    names = "; ".join(f"{label}: {titles[label]}" for label in dict.fromkeys(labels))
    return f"{names}." if names else ""


def _first_sessions(class_tables: ClassTables, addresses: Mapping[str, PageLink], study: Study | None) -> AnswerRow:
    """The sessions in which most is missed, by name, each with its miss."""
    examples = []
    for session_name, example, _ in sessions_table(class_tables.runs, addresses).rows:
        if isinstance(session_name, Marked) and isinstance(example, Marked) and example.to:
            pair, _, moment = example.text.rpartition(" at ")
            examples.append((session_name.text, pair, moment, example.to))
    examples = examples[:MOST_SESSIONS]
    pairs = {pair for _, pair, _, _ in examples}
    links = tuple(
        (f"{session_name} at {moment}" if len(pairs) == 1 else f"{session_name}: {pair} at {moment}", address)
        for session_name, pair, moment, address in examples
    )
    common_text = ""
    if len(pairs) == 1:
        common_text = f"{'All are' if len(examples) > 1 else 'It is'} of the pair {pairs.pop()}. "
    text = "Mistakes of detectors to open first:"
    if study is not None and study.changing_detectors:
        text = f"Mistakes that change it, of {joined_names(study.changing_detectors)}, for example:"
    elif study is not None and study.retested_results:
        text = "No mistake of a detector changes a conclusion. Mistakes to open:"
    return AnswerRow("When", text, f"{common_text}{FIRST_SESSIONS_SENTENCE}", links)


def _action_sentences(class_tables: ClassTables, study: Study | None) -> list[str]:
    """Sentences on the detector with which to count; where nothing is associated, on questions and students too."""
    trusted_labels = class_tables.trusted_detectors
    if study is None:
        if not trusted_labels:
            return []
        return [
            f"Count contacts with the detector {joined_names(trusted_labels, 'or')}, the reference.",
            QUESTIONNAIRE_HINT,
        ]
    recommended_detectors = (
        [study.detector] if not trusted_labels or study.detector in trusted_labels else trusted_labels
    )
    wrong_labels = [label for label in study.changing_detectors if label not in trusted_labels] or (
        [study.detector] if study.changing_detectors and study.detector not in recommended_detectors else []
    )
    instead_clause = f", not with {joined_names(wrong_labels, 'or')}" if wrong_labels else ""
    actions = [f"count contacts with the detector {joined_names(recommended_detectors, 'or')}{instead_clause}"]
    source = f"Every result about contacts on this page is counted with {study.detector}."
    if study.obstacle:
        actions.append(study.obstacle.lift)
    if study.tested and study.nothing_associated and (unreliable_scales := study.unreliable_scales):
        scales_text = (
            joined_names(unreliable_scales)
            if len(unreliable_scales) <= MOST_SCALES
            else f"{len(unreliable_scales)} scales"
        )
        actions.append(f"revise the questions on {scales_text}")
    if not more_students_needed(study):
        return [f"{_as_sentence(actions)}.", source]
    tests = tests_together(study)
    students = students_needed(MEDIUM_CORRELATION, tests)
    actions.append(f"study at least {students} students")
    return [
        f"{_as_sentence(actions)}.",
        f"Among {students} students a correlation of {MEDIUM_CORRELATION:g} is found with 80 % power "
        f"({_level_text(tests)}).",
        source,
    ]


def _as_sentence(actions: list[str]) -> str:
    """Actions joined by commas and a last *and*, with a capital."""
    *leading_actions, last_action = actions
    text = (
        f"{', '.join(leading_actions)}{',' if len(leading_actions) > 1 else ''} and {last_action}"
        if leading_actions
        else last_action
    )
    return text[:1].upper() + text[1:]


def _level_text(tests: int) -> str:
    """The level of a test, and its correction where several are made."""
    return (
        f"p < {SIGNIFICANCE_LEVEL:g}, corrected for {tests} tests"
        if tests > 1
        else f"one test at p < {SIGNIFICANCE_LEVEL:g}"
    )


def _quicker_detector_sentences(
    study: Study | None, trusted_labels: list[str], times: Mapping[str, float]
) -> list[str]:
    """The quicker detector beside the trusted that finds most and changes no conclusion; empty: there is none."""
    retested_results = study.retested_results if study is not None else []
    changing_labels = study.changing_detectors if study is not None else []
    same_detectors = [
        label for label in dict.fromkeys(row.detector for row in retested_results) if label not in changing_labels
    ]
    if changing_labels and not same_detectors:
        return ["None: every other detector that was tested changes a conclusion."]
    slowest_time = max((times.get(label, np.inf) for label in trusted_labels), default=np.inf)
    same_detectors = [
        label
        for label in same_detectors
        if label not in trusted_labels and (label not in times or times[label] < slowest_time)
    ]
    recall_of_label = {
        row.detector: row.recall
        for row in retested_results
        if row.detector in same_detectors and row.recall is not None
    }
    if not recall_of_label:
        return [f"Count with {' or '.join(same_detectors)}."] if same_detectors else []
    largest_recall = max(recall_of_label.values())
    best_detectors = [label for label, recall in recall_of_label.items() if recall == largest_recall]
    pronoun = "it" if len(best_detectors) == 1 else "each"
    recall_clause = f"{pronoun} finds {words.as_percentage(largest_recall)} of contact frames and changes no conclusion"
    return [f"Where the reference is too slow, count with {' or '.join(best_detectors)}: {recall_clause}."]


def _mean_times(class_tables: ClassTables) -> dict[str, float]:
    """Seconds a frame of each detector, in the mean of the sessions that measured them."""
    metrics = class_tables.runs.every_metric
    if MEAN_MS not in metrics.column_names:
        return {}
    seconds_of_label: dict[str, list[float]] = {}
    for row in metrics.select([DETECTOR, MEAN_MS]).to_pylist():
        if row[MEAN_MS] is not None and np.isfinite(row[MEAN_MS]):
            seconds_of_label.setdefault(row[DETECTOR], []).append(row[MEAN_MS] / 1e3)
    return {label: float(np.mean(values)) for label, values in seconds_of_label.items()}


def _cost_sentences(class_tables: ClassTables, study: Study | None, seconds_of_label: Mapping[str, float]) -> list[str]:
    """Sentences on the students that are lacking, and on the time of the recommended detector and of the others."""
    sentences = []
    seconds = class_tables.recorded_seconds
    if study is not None and (missing_students := _lacking_students(study)):
        mean = words.duration(seconds / len(class_tables.runs.metrics))
        recording_text = f" with a recording of about {mean} each" if seconds else ""
        sentences.append(f"{plural(missing_students, 'more student')}{recording_text}.")
    if not seconds_of_label:
        return [*sentences, "Times of the detectors were not measured."]
    recommended_detector = study.detector if study is not None else next(iter(class_tables.trusted_detectors), "")
    main_label = recommended_detector if recommended_detector in seconds_of_label else next(iter(seconds_of_label))
    other_labels = [label for label in seconds_of_label if label != main_label]
    main_time_text = words.frame_time(seconds_of_label[main_label])
    is_cheapest = all(
        seconds_of_label[main_label] < seconds_of_label[label]
        and main_time_text != words.frame_time(seconds_of_label[label])
        for label in other_labels
    )
    least_text = ", less than every other detector" if is_cheapest and other_labels else ""
    class_text = (
        f" ({words.duration(seconds_of_label[main_label] * seconds * FRAMES_A_SECOND)} for this class)"
        if seconds
        else ""
    )
    sentences.append(f"{main_label} takes {main_time_text} a frame{class_text}{least_text}.")
    if len(sentences) > 1:
        sentences[:2] = [f"{sentences[0][:-1]}; {sentences[1]}"]
    time_texts = ", ".join(f"{label} {words.frame_time(seconds_of_label[label])}" for label in other_labels)
    clock = f"at {FRAMES_A_SECOND:g} frames a second" if seconds else ""
    machine = " ".join(filter(None, ["Means over the sessions,", clock, "on the machine that replayed them."]))
    return [*sentences, *([f"{time_texts}."] if time_texts else []), machine]


def _lacking_students(study: Study) -> int:
    """Number of students who are lacking for a test, or for a medium correlation; 0: there are enough."""
    if study.obstacle is not None and study.obstacle.rule == "few-students":
        return max(0, LEAST_STUDENTS - study.students)
    return (
        students_needed(MEDIUM_CORRELATION, tests_together(study)) - study.students
        if more_students_needed(study)
        else 0
    )


def _certainty_row(class_tables: ClassTables, study: Study | None) -> AnswerRow:
    """How sure the effect of the detector and the associations are, and the students behind the figures."""
    students = len(class_tables.runs.students)
    intervals = "Brackets and bars are 95 % intervals: other classes like this one may give any figure within."
    if study is None:
        students_sentence = (
            f"{count_text(students)} students." if students < LEAST_IN_CELL else f"{plural(students, 'student')}."
        )
        return AnswerRow("Sure", f"Nothing is known of conclusions: none was tested in {students_sentence}", intervals)
    tests = tests_together(study)
    figures, least_size = [f"{source_sentence(study)}."], least_correlation(study.students, tests)
    if least_size is not None and study.tested:
        scale = (
            f"Among {study.students} students a correlation of {words.number(least_size, 2)} is found with 80 % power"
        )
        multiple_note = " Coefficients with others held constant are on another scale." if _has_multiple(study) else ""
        figures.insert(0, f"{scale} ({_level_text(tests)}).{multiple_note}")
        if not more_students_needed(study):
            figures.insert(
                1,
                f"A correlation of {MEDIUM_CORRELATION:g} takes {students_needed(MEDIUM_CORRELATION, tests)} students.",
            )
    refused_texts = [f"{refusal.what} ({refusal.reason})" for refusal in study.refusals]
    if refused_texts:
        more_refused = (
            f"; {len(refused_texts) - MOST_REFUSED} more under Method" if len(refused_texts) > MOST_REFUSED else ""
        )
        figures.append(f"Left out: {'; '.join(refused_texts[:MOST_REFUSED])}{more_refused}.")
    observed_text = "Only associations were observed: no figure says what causes what."
    text = " ".join(
        filter(None, [_certainty_of_detectors(study, class_tables), _certainty_of_associations(study, least_size)])
    )
    return AnswerRow("Sure", text, " ".join(figures), details=f"{intervals} {observed_text}")


def _has_multiple(study: Study) -> bool:
    """Whether a coefficient stands beside other predictors."""
    return any(finding.kind == "multiple" for finding in study.coefficients)


def _certainty_of_detectors(study: Study, class_tables: ClassTables) -> str:
    """Return how sure it is that the detector changes a conclusion, or none; ``""``: that was not tested."""
    if not study.retested_results:
        return ""
    if study.changing_detectors:
        trusted_labels = [
            label for label in (study.detector, *study.changing_detectors) if label in class_tables.trusted_detectors
        ]
        return (
            f"Sure about the detectors: they are measured against {trusted_labels[0]}, the reference."
            if trusted_labels
            else ""
        )
    detectors = len({study.detector, *(row.detector for row in study.retested_results)})
    if study.same_results:
        return f"Sure that the detector changes nothing here: {detectors} detectors give the same results."
    return f"Sure that the detector changes no conclusion here: {detectors} detectors lead to the same ones."


def _associated(study: Study) -> list[Finding]:
    """Associations, most pronounced first, then differences of groups: in the order of the headlines."""
    coefficients = sorted((row for row in study.coefficients if row.associated), key=lambda row: -abs(row.beta))
    return [*coefficients, *(row for row in study.groups if row.associated)]


def _certainty_of_associations(study: Study, least_size: float | None) -> str:
    """Return how sure it is that associations exist, or that there is none."""
    students = plural(study.students, "student")
    if not study.tested:
        return f"Nothing is known of associations: none was tested in {students}."
    if not study.nothing_associated:
        first, *others = _associated(study)
        tests, p = tests_together(study), 1.0 if first.p_holm is None else first.p_holm
        corrected = f" after correction for {tests} tests" if tests > 1 else ""
        which = "first association" if others else "association"
        return (
            f"Fairly sure of the {which} in {students}: p {p_relation(p)}{corrected}, "
            f"95 % interval {first.low:+.2f} to {first.high:+.2f}."
        )
    if least_size is None:
        return f"Not shown: that there is no association. {students} are very few."
    least_size_text = words.number(least_size, 2)
    if least_size > MEDIUM_CORRELATION:
        return f"Not shown: that there is no association. {students} can miss a correlation below {least_size_text}."
    return f"Fairly sure that no correlation is above {least_size_text}: {students} would mostly show it."
