"""``replay.advise``: a session in, what each knob of an engine would miss, invent and take out."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore.protocol import detect_live
from replay.api.auditor import audit
from replay.comparison.contact_counts import contact_counts, count_reports
from replay.comparison.outcome import Outcome
from replay.detection.run_detector import warm_frames
from replay.errors import TradeoffError
from replay.pipeline.headline import contact_words
from replay.pipeline.run_result import RunResult
from replay.pipeline.summary import look_seconds
from replay.tradeoffs.engine_knobs import EXTRA, Engine, advice_words, engine_named
from sessions import Session

LIVE_FRAMES: Final = 1350
"""Asked live where the audit was not: 15 s at 90 Hz, in which a p99 stands on 600 looks of an engine at 50 Hz."""


@dataclass(frozen=True, eq=False)
class Advice:
    """What the rows of an engine came to.

    Parameters
    ----------
    engine : with where its words are from.
    rows : one a choice that could run, plain data: ``number``, ``knobs``, ``setting`` (as ``replay audit`` takes it),
        ``contacts``, ``missed``, ``in_part``, ``undecided``, ``undecided_in_part``, ``false`` (share of the pair-frames
        reported), ``ms`` and ``p99_ms`` of a look that is asked live.
    sentences : what to change, and what could not be tried.
    result : the run behind it, a detector a row: ``row-1`` and so on.
    """

    engine: Engine
    rows: tuple[dict[str, Any], ...]
    sentences: tuple[str, ...]
    result: RunResult


def advise(session_or_path: Session | str | Path, *, engine: str, **asked: Any) -> Advice:
    """Audit the settings that a developer has in an engine, and say the smallest change that mends what is missed.

    Parameters
    ----------
    session_or_path : a session, or the file of one.
    engine : ``unity``, ``unreal`` or ``mujoco``.
    asked : as ``replay.audit``, but ``detectors``.

    Raises ``TradeoffError``: an engine that is not known or not installed; and as ``replay.audit``.
    """
    chosen = engine_named(engine)
    if module := _lacks(chosen.choices[0].setting):
        raise TradeoffError(f'{module} itself is asked and is not installed; pip install -e ".[engines]"')
    lacking = {k: module for k, one in enumerate(chosen.choices, 1) if (module := _lacks(one.setting))}
    numbers = {f"row-{k}": k for k in range(1, len(chosen.choices) + 1) if k not in lacking}
    specs = {label: chosen.choices[k - 1].setting for label, k in numbers.items()}
    (result,) = audit(session_or_path, detectors=specs, faces=False, **asked).results
    rows = [_row(result, label, k, chosen) for label, k in numbers.items() if label in result.comparisons]
    left = [
        f'Row {k} was not tried: {module} is not installed; pip install -e ".[engines]"'
        for k, module in lacking.items()
    ]
    return Advice(chosen, tuple(rows), (*advice_words(chosen.name, rows), *left), result)


def _lacks(setting: str) -> str:
    """The module that a setting needs and that is not installed, or nothing."""
    return next((module for part, module in EXTRA.items() if part in setting and find_spec(module) is None), "")


def _row(result: RunResult, label: str, number: int, engine: Engine) -> dict[str, Any]:
    """Counted as the audit counts; the time is taken live, from the audit's own looks where it took them."""
    counts, said = contact_counts(result, label), count_reports(result.comparisons[label])
    seconds = look_seconds(result.detections[label])
    if seconds is None:
        detector, motion = result.detectors[label], result.assembly.motion
        detect_live(detector, motion.take(warm_frames(len(motion))))
        seconds = look_seconds(detect_live(detector, motion.frames(0, min(len(motion), LIVE_FRAMES))))
    ms = 1e3 * (seconds if seconds is not None and len(seconds) else np.zeros(1))
    choice = engine.choices[number - 1]
    return {
        "number": number, "knobs": dict(choice.knobs), "setting": choice.setting, "contacts": counts.contacts,
        "missed": counts.missed, "in_part": counts.in_part, "undecided": counts.undecided,
        "undecided_in_part": counts.undecided_in_part, "words": contact_words(counts) if counts.contacts else "",
        "false": said.share(Outcome.INVENTED)["share"], "ms": float(ms.mean()), "p99_ms": float(np.quantile(ms, 0.99)),
    }  # fmt: skip
