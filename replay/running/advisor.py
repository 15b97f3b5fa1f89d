"""``replay.advise``: a session in, what each setting of an engine gets wrong and takes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from cdcore.detectors.detector_table import detector_row
from replay.advice.collider_search import Deadline, cut_in_time
from replay.advice.engine_knobs import Choice, Engine, advice_text, engine_named
from replay.advice.scoring import wrong_counts
from replay.advice.sweep import TIME_LIMIT_S
from replay.cutting.piece_store import PIECES_ARE_KEPT, not_tried_sentences, pieces_are_stored
from replay.detection.detector_spec import parse_detectors
from replay.detection.progress import Silent
from replay.detection.run_detector import cuts_of_spec
from replay.document.run_result import RunResult
from replay.engine import prepare
from replay.errors import AuditError, TradeoffError
from replay.prepare.frame_times import frame_rate
from replay.running.runner import open_session, run
from replay.words import duration, joined_names
from sessions import Session

PREPARE_OPTIONS: Final = ("pairs", "start", "end", "policy", "progress")
"""Options of a run that its preparation takes."""


@dataclass(frozen=True, eq=False)
class Advice:
    """Measured rows of one engine.

    Parameters
    ----------
    engine : with the pages that its rows are from.
    rows : one a choice that could run, plain data: ``number``, ``knobs``, ``setting`` (as ``replay run`` takes it),
        ``pages``, ``consequence``, ``contacts``, ``missed``, ``late`` and ``false_contacts`` (means over the
        sampling offsets, with ``_smallest`` and ``_largest``), ``undecided``, ``loss``, ``not_reported`` (share of
        the contact time), ``false`` (share of the reported time), ``ms`` a frame and ``p99_ms``, ``None`` where it is
        not asked frame by frame.
    sentences : what to change, and what could not be tried.
    result : the run behind it, a detector a row: ``row-1`` and so on.
    time_limit : seconds that cutting was given; ``None``: no limit.
    not_tried : sentences about cuts that there was no time for; rows that need them are left out.
    """

    engine: Engine
    rows: tuple[dict[str, Any], ...]
    sentences: tuple[str, ...]
    result: RunResult
    time_limit: float | None = None
    not_tried: tuple[str, ...] = ()


def advise(
    session_or_path: Session | str | Path, *, engine: str, time_limit: float | None = TIME_LIMIT_S, **options: Any
) -> Advice:
    """Audit the settings that a developer has in an engine, and name the one with the smallest loss.

    Parameters
    ----------
    session_or_path : a session, or the file of one.
    engine : ``unity``, ``unreal`` or ``mujoco``.
    time_limit : seconds for cutting meshes into convex pieces; a row whose pieces are not cut by then is left out.
        ``None``: no limit. Replaying the rows is not in it.
    options : as ``replay.run``, but ``detectors``.

    Raises ``TradeoffError``: an engine that is not known or not installed; and as ``replay.run``.
    """
    if options.get("oracle") == "none":
        raise AuditError("advice needs a reference to compare with; leave oracle out for the exact one")
    session = open_session(session_or_path, options.pop("scene", None))
    engine_row = engine_named(engine)
    choices = [
        choice for choice in engine_row.choices if session.colliders or choice.settings.get("shape") != "shipped"
    ]
    engine_of_row = {number: detector_row(choice.detector).engine for number, choice in enumerate(choices, 1)}
    missing_module_of_row = {
        number: module for number, module in engine_of_row.items() if module and find_spec(module) is None
    }
    if 1 in missing_module_of_row:
        raise TradeoffError(
            f'{missing_module_of_row[1]} itself is needed and is not installed; pip install "vrlab-replay[engines]"'
        )
    frames_hz = frame_rate(session.stamps() / 1e9)
    setting_of_label = {
        f"row-{number}": choice.detector_text(frames_hz)
        for number, choice in enumerate(choices, 1)
        if number not in missing_module_of_row
    }
    uncut_colliders = _cut_colliders(session, setting_of_label, time_limit, options)
    if options.get("oracle") in uncut_colliders.labels:
        raise TradeoffError(
            f"the reference, {options['oracle']}, needs convex pieces that were not cut in time; give it a longer limit"
        )
    result = run(
        session,
        detectors={
            label: setting for label, setting in setting_of_label.items() if label not in uncut_colliders.labels
        },
        **options,
    )
    rows = [
        _choice_row(result, label, choices[_row_number(label) - 1], setting)
        for label, setting in setting_of_label.items()
        if label in result.comparisons
    ]
    not_installed_sentences = [
        f'Row {number} was not tried: {module} is not installed; pip install "vrlab-replay[engines]"'
        for number, module in missing_module_of_row.items()
    ]
    return Advice(
        engine=engine_row,
        rows=tuple(rows),
        sentences=(*advice_text(engine_row.name, rows), *not_installed_sentences, *uncut_colliders.remarks(time_limit)),
        result=result,
        time_limit=time_limit,
        not_tried=uncut_colliders.sentences,
    )


@dataclass(frozen=True)
class _UncutColliders:
    """Labels of the rows whose convex pieces there was no time for, and sentences about their cuts.

    ``others_are_cut``: whether other pieces are cut; where they are stored, the same command goes on from them.
    """

    labels: tuple[str, ...]
    sentences: tuple[str, ...]
    others_are_cut: bool

    def remarks(self, time_limit: float | None) -> list[str]:
        """Sentences about the rows that were not tried, about their cuts, and what to do."""
        if not self.labels or time_limit is None:
            return []
        numbers = [str(_row_number(label)) for label in self.labels]
        subject = f"Row {numbers[0]} was" if len(numbers) == 1 else f"Rows {joined_names(numbers)} were"
        sentences = [
            f"{subject} not tried within {duration(time_limit)}: a longer --time-limit tries more.",
            *self.sentences,
        ]
        if self.others_are_cut and pieces_are_stored():
            sentences.append(f"{PIECES_ARE_KEPT.capitalize()}.")
        return sentences


def _cut_colliders(
    session: Session, setting_of_label: Mapping[str, str], time_limit: float | None, options: Mapping[str, Any]
) -> _UncutColliders:
    """Cut the convex pieces that rows need within the time limit; the rows that lack some."""
    progress = options.get("progress") or Silent()
    prepared_session = prepare(session, **{key: options[key] for key in PREPARE_OPTIONS if key in options})
    cuts_of_label = {
        spec.label: cuts_of_spec(spec, prepared_session.assembly) for spec in parse_detectors(setting_of_label)
    }
    # Rows have the same bodies, and most rows the same cuts.
    cuts = {(name, cut.key): (name, cut) for cut_of_body in cuts_of_label.values() for name, cut in cut_of_body.items()}
    stage = "Cutting convex pieces" + ("" if time_limit is None else f", {duration(time_limit)} at most")
    with progress.stage(stage, None if time_limit is None else 100) as advance:
        not_cut_by_key = cut_in_time([cut for _, cut in cuts.values()], Deadline(time_limit, advance))
    late_keys = {key for key, not_cut in not_cut_by_key.items() if not_cut.late}
    return _UncutColliders(
        labels=tuple(
            label
            for label, cut_of_body in cuts_of_label.items()
            if not late_keys.isdisjoint(cut.key for cut in cut_of_body.values())
        ),
        sentences=tuple(not_tried_sentences([(name, cut) for name, cut in cuts.values() if cut.key in late_keys])),
        others_are_cut=any(cut.row.seconds and cut.key not in not_cut_by_key for _, cut in cuts.values()),
    )


def _row_number(label: str) -> int:
    """The number of the row that a detector of the run stands for."""
    return int(label.removeprefix("row-"))


def _choice_row(result: RunResult, label: str, choice: Choice, setting: str) -> dict[str, Any]:
    contact_counts, seconds = result.counts[label], result.document.detectors[label].seconds
    return {
        "number": _row_number(label),
        "knobs": dict(choice.knobs),
        "setting": setting,
        "pages": list(choice.pages),
        "consequence": choice.consequence,
        "contacts": contact_counts.contacts,
        "undecided": contact_counts.with_undecided_frames,
        **errors_of_detector(result, label),
        "ms": 1e3 * seconds.per_frame_mean,
        "p99_ms": None if seconds.p99 is None else 1e3 * seconds.p99,
    }


def errors_of_detector(result: RunResult, label: str) -> dict[str, Any]:
    """Returns the errors of a detector of a run, as a row of ``replay.tradeoff`` has it."""
    false_contact, false_contact_count = result.document.audit[label].false_contact, len(result.false[label])
    return wrong_counts(result.counts[label], false_contact_count, false_contact, result.phases.get(label))
