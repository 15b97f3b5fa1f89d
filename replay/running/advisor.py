"""``replay.advise``: a session in, what each setting of an engine gets wrong and takes out."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from cdcore.detectors.detector_table import detector_row
from replay.advice.engine_knobs import Choice, Engine, advice_text, engine_named
from replay.advice.scoring import wrong_counts
from replay.document.run_result import RunResult
from replay.errors import AuditError, TradeoffError
from replay.prepare.frame_times import frame_rate
from replay.running.runner import open_session, run
from sessions import Session


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
    """

    engine: Engine
    rows: tuple[dict[str, Any], ...]
    sentences: tuple[str, ...]
    result: RunResult


def advise(session_or_path: Session | str | Path, *, engine: str, **options: Any) -> Advice:
    """Audit the settings that a developer has in an engine, and name the one with the smallest loss.

    Parameters
    ----------
    session_or_path : a session, or the file of one.
    engine : ``unity``, ``unreal`` or ``mujoco``.
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
    choice_of_label = {
        f"row-{number}": choice for number, choice in enumerate(choices, 1) if number not in missing_module_of_row
    }
    result = run(
        session,
        detectors={label: choice.detector_text(frames_hz) for label, choice in choice_of_label.items()},
        **options,
    )
    rows = [
        _choice_row(result, label, choice, choice.detector_text(frames_hz))
        for label, choice in choice_of_label.items()
        if label in result.comparisons
    ]
    not_tried_sentences = [
        f'Row {number} was not tried: {module} is not installed; pip install "vrlab-replay[engines]"'
        for number, module in missing_module_of_row.items()
    ]
    return Advice(engine_row, tuple(rows), (*advice_text(engine_row.name, rows), *not_tried_sentences), result)


def _choice_row(result: RunResult, label: str, choice: Choice, setting: str) -> dict[str, Any]:
    contact_counts, seconds = result.counts[label], result.document.detectors[label].seconds
    return {
        "number": int(label.removeprefix("row-")),
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
