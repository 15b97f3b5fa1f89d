"""The first sentence of a comparison of two runs: whether the second is better, and by how much."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

from replay import words
from replay.document.run_document import RunDocument

if TYPE_CHECKING:
    from replay.studies.diff.runs import CountBoundsPair, DetectorDiff

REPLAY_SETTINGS: Final = ("session.frames", "session.bodies", "window", "oracle", "pairs", "tau", "session.digest")
"""Differences with which the errors of two runs are not of the same contacts."""

LEAST_GAIN: Final = 1e-9
"""Two losses that differ by less are the same: means are sums of rounded numbers."""


def answer_of(
    first_run: RunDocument,
    second_run: RunDocument,
    detectors: Mapping[str, DetectorDiff],
    settings: Mapping[str, tuple[Any, Any]],
) -> str:
    """Return whether the second run is better, of the detector with the largest change of loss."""
    compared_detectors = {
        name: detector for name, detector in detectors.items() if first_run.oracle not in detector.labels
    }
    has_change = any(detector.changed for detector in detectors.values())
    audited_detectors = [detector for detector in compared_detectors.values() if None not in detector.loss]
    if not compared_detectors:
        contacts = "contacts changed" if has_change else "no contact changed"
        return f"No detector but the reference is in both runs; {contacts}." if detectors else "No detector compares."
    if not audited_detectors:
        return f"{_changes_sentence(compared_detectors.values())} No reference says which run is right."
    reason = _reason_not_to_compare(first_run, second_run, settings)
    if reason:
        return f"{_changes_sentence(compared_detectors.values())} Whether that is better cannot be told: {reason}."
    most_changed = max(audited_detectors, key=lambda detector: abs(_loss_gain(detector)))
    return _comparison_sentence(
        most_changed,
        second_run.audit[most_changed.labels[1]].contacts,
        same_machine="machine" not in _setting_groups(settings),
    )


def _comparison_sentence(detector: DetectorDiff, contacts: int, *, same_machine: bool) -> str:
    """``Yes: hull50 -> shipped50: false contact 86 % -> 8 %, 0 of 18 contacts missed in both, loss 0.9 -> 0.1.``"""
    label_before, label_after = detector.labels
    loss_gain = _loss_gain(detector)
    false_before, false_after = (100 * (fraction or 0.0) for fraction in detector.false_contact)
    is_false_worse = false_after > false_before if loss_gain > 0 else false_after < false_before
    worse_counts = [
        _has_risen(ranges) if loss_gain > 0 else _has_fallen(ranges) for ranges in (detector.missed, detector.late)
    ]
    subject = label_after if label_before == label_after else f"{label_before} -> {label_after}"
    change_texts = (
        f"{_false_text(detector)}, {_missed_text(detector, contacts)}, {_late_text(detector)}{_loss_text(detector)}"
    )
    cost = f"; {_cost_text(detector)}" if same_machine else ""
    if abs(loss_gain) < LEAST_GAIN:
        same_text = "it makes the same errors" if not detector.changed else "other contacts, and the same loss"
        return f"No difference: {subject}: {same_text} ({change_texts}){cost}."
    balance_text = ", on balance" if is_false_worse or any(worse_counts) else ""
    return f"{'Yes' if loss_gain > 0 else 'No, worse'}{balance_text}: {subject}: {change_texts}{cost}."


def _loss_gain(detector: DetectorDiff) -> float:
    """Loss that the second run does not have."""
    loss_before, loss_after = detector.loss
    return (loss_before or 0.0) - (loss_after or 0.0)


def _false_text(detector: DetectorDiff) -> str:
    false_before, false_after = (words.as_percentage(fraction or 0.0) for fraction in detector.false_contact)
    return (
        f"{false_before} false contact in both"
        if false_before == false_after
        else f"false contact {false_before} -> {false_after}"
    )


def _missed_text(detector: DetectorDiff, contacts: int) -> str:
    missed_before, missed_after = (words.count_range(counts or (0, 0)) for counts in detector.missed)
    contacts_text = words.plural(contacts, "contact")
    return (
        f"{missed_before} of {contacts_text} missed in both"
        if missed_before == missed_after
        else f"missed {missed_before} -> {missed_after} of {contacts_text}"
    )


def _late_text(detector: DetectorDiff) -> str:
    """``late or cut short 1-3 -> 3-5, ``, and nothing where it is the same."""
    late_before, late_after = (words.count_range(counts or (0, 0)) for counts in detector.late)
    return "" if late_before == late_after else f"late or cut short {late_before} -> {late_after}, "


def _has_risen(ranges: CountBoundsPair) -> bool:
    """Whether more contacts are counted in the second run, over the sampling offsets."""
    count_before, count_after = (sum(counts or (0, 0)) for counts in ranges)
    return count_after > count_before


def _has_fallen(ranges: CountBoundsPair) -> bool:
    """Whether fewer contacts are counted in the second run."""
    return _has_risen(ranges[::-1])


def _loss_text(detector: DetectorDiff) -> str:
    loss_before, loss_after = (words.loss_number(loss or 0.0) for loss in detector.loss)
    return f"loss {loss_before} in both" if loss_before == loss_after else f"loss {loss_before} -> {loss_after}"


def _cost_text(detector: DetectorDiff) -> str:
    seconds_before, seconds_after = detector.mean_seconds
    if words.frame_time(abs(seconds_after - seconds_before)) == words.frame_time(0.0):
        return "the same time a frame"
    return (
        f"{words.frame_time(abs(seconds_after - seconds_before))} "
        f"{'more' if seconds_after >= seconds_before else 'less'} a frame"
    )


def _changes_sentence(detectors: Iterable[DetectorDiff]) -> str:
    """``Contacts: 1 gained, 40 lost, 2 shifted.``"""
    all_detectors = list(detectors)
    gained, lost, shifted = (
        sum(len(getattr(detector, change_kind)) for detector in all_detectors)
        for change_kind in ("gained", "lost", "shifted")
    )
    if not any((gained, lost, shifted)):
        return "No contact changed."
    return f"Contacts: {gained:,} gained, {lost:,} lost, {shifted:,} shifted."


def _reason_not_to_compare(
    first_run: RunDocument, second_run: RunDocument, settings: Mapping[str, tuple[Any, Any]]
) -> str:
    """Why errors of the two runs are not of the same contacts, as the end of a sentence; ``""``: they are."""
    if first_run.session.digest != second_run.session.digest:
        return "the runs replay different recordings"
    differing_names = [name for name in REPLAY_SETTINGS if name in settings or name in _setting_groups(settings)]
    if differing_names:
        return f"the runs differ in {' and '.join(differing_names)}"
    reference_digests = [run.detectors[run.oracle].digest for run in (first_run, second_run) if run.oracle]
    if len(set(reference_digests)) > 1:
        return "the contacts of the reference differ: the meshes are others"
    return ""


def _setting_groups(settings: Mapping[str, tuple[Any, Any]]) -> set[str]:
    """First two words of the names of all settings: ``window``, ``session.bodies``."""
    return {name.partition(".")[0] for name in settings} | {".".join(name.split(".")[:2]) for name in settings}
