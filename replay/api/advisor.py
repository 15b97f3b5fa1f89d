"""``replay.advise``: a session in, what each knob of an engine would miss, invent and take out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from replay.api.runner import opened, run
from replay.comparison.contact_counts import contact_counts, count_reports
from replay.comparison.outcome import Outcome
from replay.errors import AuditError, TradeoffError
from replay.pipeline.headline import contact_words
from replay.pipeline.run_result import RunResult
from replay.tradeoffs.engine_knobs import EXTRA, SHIPPED, Engine, advice_words, engine_named
from sessions import Session


@dataclass(frozen=True, eq=False)
class Advice:
    """What the rows of an engine came to.

    Parameters
    ----------
    engine : with where its words are from.
    rows : one a choice that could run, plain data: ``number``, ``knobs``, ``setting`` (as ``replay run`` takes it),
        ``contacts``, ``missed``, ``in_part``, ``undecided``, ``undecided_in_part``, ``false`` (share of the pair-frames
        reported), ``ms`` a frame and ``p99_ms`` of a look, ``None`` where it is not asked live.
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
    asked : as ``replay.run``, but ``detectors``.

    Raises ``TradeoffError``: an engine that is not known or not installed; and as ``replay.run``.
    """
    if asked.get("oracle") == "none":
        raise AuditError("advice needs an oracle to compare with; leave oracle out for the exact one")
    held = opened(session_or_path, asked.pop("scene", None))
    chosen = engine_named(engine)
    if not held.colliders:
        chosen = replace(chosen, choices=tuple(one for one in chosen.choices if SHIPPED not in one.setting))
    if module := _lacks(chosen.choices[0].setting):
        raise TradeoffError(f'{module} itself is asked and is not installed; pip install "vrlab-replay[engines]"')
    lacking = {k: module for k, one in enumerate(chosen.choices, 1) if (module := _lacks(one.setting))}
    numbers = {f"row-{k}": k for k in range(1, len(chosen.choices) + 1) if k not in lacking}
    specs = {label: chosen.choices[k - 1].setting for label, k in numbers.items()}
    result = run(held, detectors=specs, **asked)
    rows = [_row(result, label, k, chosen) for label, k in numbers.items() if label in result.comparisons]
    left = [
        f'Row {k} was not tried: {module} is not installed; pip install "vrlab-replay[engines]"'
        for k, module in lacking.items()
    ]
    return Advice(chosen, tuple(rows), (*advice_words(chosen.name, rows), *left), result)


def _lacks(setting: str) -> str:
    """The module that a setting needs and that is not installed, or nothing."""
    return next((module for part, module in EXTRA.items() if part in setting and find_spec(module) is None), "")


def _row(result: RunResult, label: str, number: int, engine: Engine) -> dict[str, Any]:
    counts, said = contact_counts(result, label), count_reports(result.comparisons[label])
    seconds, choice = result.summary["detectors"][label]["seconds"], engine.choices[number - 1]
    looks = seconds.get("per_frame")
    return {
        "number": number, "knobs": dict(choice.knobs), "setting": choice.setting, "contacts": counts.contacts,
        "missed": counts.missed, "in_part": counts.in_part, "undecided": counts.undecided,
        "undecided_in_part": counts.undecided_in_part, "words": contact_words(counts) if counts.contacts else "",
        "false": said.share(Outcome.INVENTED)["share"], "ms": 1e3 * seconds["per_frame_mean"],
        "p99_ms": None if looks is None else 1e3 * looks["p99"],
    }  # fmt: skip
