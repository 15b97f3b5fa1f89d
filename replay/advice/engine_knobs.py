"""Settings of engines, in their own terms: the rows of ``engines.toml``."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final

from replay.advice.pareto import wrong_text
from replay.advice.settings import FASTEST_RATE_RATIO
from replay.detection.detector_spec import spec_text
from replay.errors import TradeoffError
from replay.words import plural

Row = Mapping[str, Any]

LEAST_LOSS_REDUCTION: Final = 0.05
"""A row whose loss is not less than the first one's by this share of it is not advised."""


@dataclass(frozen=True)
class Choice:
    """One row: what is set beside the first row (knob -> value), and the detector that answers for it.

    ``pages`` are names of the engine's pages that say so; ``consequence``: what else comes of it, a sentence.
    """

    knobs: Mapping[str, str]
    settings: Mapping[str, Any]
    pages: Sequence[str]
    detector: str = "collider"
    consequence: str = ""

    def detector_text(self, frames_hz: float) -> str:
        """Argument of ``replay run --detectors``; a step as fast as the recording sees every frame and has no rate."""
        is_every_frame = self.settings["rate_hz"] >= FASTEST_RATE_RATIO * frames_hz
        kept_settings = {key: value for key, value in self.settings.items() if key != "rate_hz" or not is_every_frame}
        return spec_text(self.detector, kept_settings)


@dataclass(frozen=True)
class Engine:
    """An engine as a new project has it (the first choice), and changes of it.

    ``pages``: name -> address; ``step_hz``: of a new project.
    """

    name: str
    version: str
    pages: Mapping[str, str]
    choices: Sequence[Choice]
    notes: Sequence[str]
    step_hz: float


@cache
def engines() -> dict[str, Engine]:
    """Name on the command line -> the engine."""
    tables = tomllib.loads(files("replay.advice").joinpath("engines.toml").read_text("utf-8"))
    return {
        name: Engine(**{**table, "choices": [Choice(**choice) for choice in table["choices"]]})
        for name, table in tables.items()
    }


def engine_named(name: str) -> Engine:
    """The engine of that name; TradeoffError with the names there are."""
    if name not in engines():
        raise TradeoffError(f"no engine {name!r}; there are: {', '.join(engines())}")
    return engines()[name]


def knob_text(knobs: Mapping[str, str]) -> str:
    """``Fixed Timestep 0.02, Mesh Collider Convex``."""
    return ", ".join(f"{knob} {value}" for knob, value in knobs.items())


def advice_text(engine: str, rows: Sequence[Row]) -> list[str]:
    """Sentences on the errors of the first row and the row with the smallest loss; ``rows`` are of one session.

    Of rows with equal losses the one that changes the fewest settings is taken. A row is advised only where it takes
    ``LEAST_LOSS_REDUCTION`` off the loss of the first one: what changes nothing is no advice.
    """
    first_row = rows[0]
    if not first_row["contacts"]:
        no_contact_sentence = f"No contact happened that {engine} could miss."
        return (
            [no_contact_sentence, "All that row 1 reports is false."] if first_row["false"] else [no_contact_sentence]
        )
    if not first_row["loss"]:
        return [f"Row 1 gets each of {plural(first_row['contacts'], 'contact')} right."]
    best_row = min(rows, key=lambda row: (row["loss"], len(row["knobs"]), row["number"]))
    sentences = [f"Row {first_row['number']}: {_all_wrong(first_row)}."]
    if best_row["loss"] > (1.0 - LEAST_LOSS_REDUCTION) * first_row["loss"]:
        return [*sentences, "No other row that was tried is clearly better."]
    cure_sentence = (
        f"Take row {best_row['number']} ({knob_text(best_row['knobs'])}): {_all_wrong(best_row)} "
        f"(measured on this session)."
    )
    return [*sentences, cure_sentence, *([best_row["consequence"]] if best_row["consequence"] else [])]


def _all_wrong(errors_row: Row) -> str:
    """``0-1 of 18 contacts missed, 1-3 late or cut short, 86 % of its contact time false, 2 undecided``."""
    return (
        f"{wrong_text(errors_row)}, {errors_row['undecided']} undecided"
        if errors_row["undecided"]
        else wrong_text(errors_row)
    )
