"""Output of ``run`` and ``demo``: the answer or JSON on stdout, notes on stderr."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from replay.cli.console import EXIT_DATA_LOSS, EXIT_OK, People, answer, print_as_json, show
from replay.document.coding import plain_of
from replay.document.run_result import RunResult
from replay.document.session import FlaggedPoses
from replay.prepare.repair import DAMAGE_CODES
from replay.show.results.run_folder import PICTURE_FILE

if TYPE_CHECKING:
    from rich.console import RenderableType

Sources: TypeAlias = Mapping[str, tuple[str, ...]]
"""``detector NAME`` or ``effect KIND`` -> citations."""


def report_run(
    result: RunResult,
    people: People,
    broken_limits: Sequence[str] = (),
    *,
    as_json: bool = False,
    recording: Path | None = None,
) -> int:
    """Print a run, the tables and sources too for who wants more; the exit code: 3 when frames could not be used.

    ``broken_limits`` are the gates that failed; they stand in the JSON. ``recording`` is the file that was replayed.
    """
    from replay.document.placeholders import SESSION

    sources, open_commands = sources_of(result, people), commands_to_open(result)
    code = close_run(result, people)
    if as_json:
        print_as_json(run_json(result) | {"broken": [*broken_limits]} | ({"sources": sources} if sources else {}))
        people.say("", *open_commands)
        return code
    from replay.cli.run_tables import run_screen, run_tables

    if people.verbose:
        answer_cited(False, {}, lambda: run_tables(result), sources)
    show(run_screen(result, open_commands, recording=str(recording or SESSION), verbose=people.verbose))
    return code


def sources_of(result: RunResult, people: People) -> Sources:
    """For who wants more, the sources behind a run: of every detector and effect that ran, and of no others."""
    from replay.document.citations import sources_behind

    detectors = (detector.name for detector in result.document.detectors.values())
    return sources_behind(detectors, result.effects.items()) if people.verbose else {}


def answer_cited(
    as_json: bool, json_value: Mapping[str, Any], render: "Callable[[], RenderableType]", sources: Sources
) -> None:
    """``answer``, with the sources behind it, if there are any."""
    from replay.document.citations import citations

    answer(as_json, {**json_value, "sources": sources} if sources else json_value, render)
    if sources and not as_json:
        show(["", *citations(sources).splitlines()])


def close_run(result: RunResult, people: People) -> int:
    """Say what people should know about a run, and return its exit code: 3 where poses or frames had to be left out."""
    for label, detector in result.document.detectors.items():
        settings = ", ".join(f"{name}={value}" for name, value in detector.settings.items())
        people.detail(f"{label}: {detector.name}[{settings}], verdicts {detector.digest}")
    document = result.document
    notes = [*document.session.notes, *repair_sentences(document.flagged)]
    if document.session.left_out:
        notes.append(f"no mesh, so not tested: {', '.join(document.session.left_out)}")
    people.say(*(f"note: {note}" for note in notes))
    return EXIT_DATA_LOSS if document.session.dropped_frames.total or lost_poses(document.flagged) else EXIT_OK


def commands_to_open(result: RunResult) -> list[str]:
    """The commands that show a run: the picture at the moment of its answer, and the page."""
    if result.out is None:
        return ["Nothing was written; with --out DIR there are a report, tables and a picture of every moment."]
    lines = [f"Read it  {result.out / 'report.html'}   (-v prints every table here)"]
    if (result.out / PICTURE_FILE).is_file():
        moment = moment_option = ""
        if result.answers and result.answers[0].moment is not None:
            moment = f" {result.answers[0].moment.option}"
            moment_option = f" --by {result.answers[0].label}" if len(result.comparisons) > 1 else ""
        lines.insert(0, f"See it   replay view {result.out}{moment}{moment_option}")
    return lines


def lost_poses(flagged: Iterable[FlaggedPoses]) -> int:
    """Samples that claimed to be poses and were none."""
    return sum(poses.dropped for poses in flagged if poses.kind in DAMAGE_CODES)


def repair_sentences(flagged: Iterable[FlaggedPoses]) -> list[str]:
    """A sentence per kind and body whose poses were in doubt; losses that the tracker flagged itself go without."""
    samples: Counter[tuple[str, str, str]] = Counter()
    for poses in flagged:
        if poses.kind not in ("tracking-lost", "gap"):
            samples[poses.kind, poses.body, poses.action] += poses.samples
    return [
        f"{kind}{' of ' + body if body else ''}: {count} samples, {action}"
        for (kind, body, action), count in samples.items()
    ]


def run_json(result: RunResult) -> dict[str, Any]:
    """The document, the misses, the false contacts, and where the rest lies; null: not measured."""
    rows_by_table = {
        name: {label: result.tables[name].where(detector=label).plain() for label in result.comparisons}
        for name in ("misses", "false")
    }
    return {**plain_of(result.document), **rows_by_table, "out": None if result.out is None else str(result.out)}
