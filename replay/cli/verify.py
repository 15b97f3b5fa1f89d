"""``replay verify``: whether every verdict of a run is so, from its proof and the recording."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from replay.cli.console import GATE_FAILED, OK, People, answer
from replay.cli.options import RUN_FOLDER, SESSION_FILE, reporting, scene


@click.command()
@click.argument("run", type=RUN_FOLDER, metavar="RUN")
@click.option("--session", type=SESSION_FILE, metavar="FILE", help="The recording, where it is not found by itself.")
@scene
@reporting
def command(run: Path, session: Path | None, scene: Path | None, as_json: bool, people: People) -> int:
    """Check the proof that `replay run --proof` wrote: by a program of its own, which shares no code with `exact`.

    Every pair in every frame is covered. Exit code 4 and the first record that does not hold, if one does not.

    \b
    replay run session.mcap --out RUN --proof
    replay verify RUN
    """
    from replay.outputs.results.proof_folder import verify_run
    from replay.proof.claims import WrongRecord

    people.say(f"checking the proof of {run}")
    try:
        told = verify_run(run, session, scene)
    except WrongRecord as error:
        wrong = str(error)
        answer(as_json, {"holds": False, "wrong": wrong}, lambda: f"does not hold: {wrong}")
        return GATE_FAILED
    answer(as_json, {"holds": True, **told}, lambda: "\n".join(sentences(told)))
    return OK


def sentences(told: Mapping[str, Any]) -> list[str]:
    """What was proven, and what it rests on."""
    verdicts, checked, poses = told["verdicts"], told["checked"], told["poses"]
    return [
        f"holds: {told['frames']:,} frames of {told['pairs']:,} pairs, every verdict proven",
        " " + ", ".join(f"{count:,} {word}" for word, count in verdicts.items() if count),
        f" checked: {checked['boxes']:,} boxes apart, {checked['face_pairs']:,} face pairs of which integers decided "
        f"{checked['by_integers']:,}, {checked['rays']:,} rays",
        f" poses: {poses.get('recorded', 0):,} from the recording; from the proof "
        f"{poses.get('interpolated', 0):,} interpolated, {poses.get('held', 0):,} held; left out by the policy: "
        f"{poses.get('left_out', 0):,}",
        f" the proof has {told['bytes']:,} bytes",
        *([f" pairs not asked: {', '.join(told['pairs_not_asked'])}"] if told["pairs_not_asked"] else []),
        *(f" containment of {why}" for why in told["containment_refused"]),
    ]
