"""``replay demo``: everything once, on a synthetic session whose contacts are known."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from replay import words
from replay.cli.console import EXIT_DATA_LOSS, EXIT_OK, People, TerminalProgress, progress_counter, show
from replay.cli.options import ANY_PATH, FIX_SECONDS, fix_time, force, jobs, reporting, require_free
from sessions.temporary_folders import temporary_folder

if TYPE_CHECKING:
    from replay.document.run_result import RunResult

DEMO_FOLDER: Final = Path("replay-demo")
CLASS_FOLDER: Final = Path("class")
SESSION_FILE: Final = "session.mcap"

STUDENT_COUNT: Final = 52
"""As many as in the paper's study."""


@click.command()
@click.option("--scene", default="bench-bumps", show_default=True, help="Which made-up session.")
@click.option("--session-only", is_flag=True, help="Record the session file and stop.")
@click.option(
    "--class",
    "students",
    type=click.IntRange(min=5, max=999),
    metavar="STUDENTS",
    help=f"A class of so many students instead (the paper's: {STUDENT_COUNT}), with its study and its page.",
)
@click.option("--brief", is_flag=True, help="With --class: touches so brief that colliders at 50 Hz miss some.")
@click.option("-o", "--out", type=ANY_PATH, help=f"Folder, or with --session-only the file.  [default: {DEMO_FOLDER}]")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the made-up session.")
@click.option(
    "--noise", type=click.Choice(["vive", "off"]), help="Noise of the made-up tracker.  [default: vive at a bench]"
)
@fix_time
@jobs
@force
@reporting
def command(
    session_only: bool,
    students: int | None,
    brief: bool,
    jobs: int,
    out: Path | None,
    force: bool,
    as_json: bool,
    people: People,
    fix_time: float | None,
    **made: Any,
) -> int:
    """Record a made-up lab session to MCAP, replay it through the paper's pipeline and an engine's colliders.

    \b
    replay demo
    replay demo --scene titration --session-only -o titration.mcap
    replay demo --class 52 -o class
    """
    if students is not None:
        if session_only or made["noise"] or fix_time:
            raise click.UsageError("--class makes a class; leave out --session-only, --noise and --fix-time")
        return _demo_class(out or CLASS_FOLDER, students, brief=brief, seed=made["seed"], jobs=jobs, people=people)
    if brief:
        raise click.UsageError("--brief is for --class")
    from replay.cli.run_report import report_run
    from replay.show.results.without_pandas import leave_pandas_out
    from sessions.synthetic.truth import truth_path

    leave_pandas_out()
    stage = f"making up a session in a laboratory ({made['scene']})"
    if session_only:
        session_file = out or Path(f"{made['scene']}.mcap")
        require_free(session_file, truth_path(session_file), overwrite=force)
        people.say(f"{stage} and recording it ...")
        _write_made_up_session(session_file, **made)
        people.say(f"what was planted in it: {truth_path(session_file)}")
        show(str(session_file))
        return 0
    people.say(f"{stage}, recording it, replaying it ...")
    folder = out or DEMO_FOLDER
    seconds = FIX_SECONDS if fix_time is None else fix_time
    result = _run_demo(folder, force or out is None, people, fix_time=seconds, **made)
    seconds = result.document.session.duration
    people.say(f"Made up a {words.decimal(seconds, 0)} s session: {folder / SESSION_FILE}")
    return report_run(result, people, as_json=as_json, recording=folder / SESSION_FILE)


def _write_made_up_session(session_file: Path, *, scene: str, seed: int, noise: str | None) -> Path:
    """Write the session and, beside it, what was planted in it: for people and tests, never read by the tool."""
    from replay.studies.synthetic_sessions import synthetic_session
    from sessions import write_session
    from sessions.synthetic.truth import truth_path, write_truth

    session, planted_truth = synthetic_session(scene, seed, noise)
    write_session(session, session_file)
    write_truth(planted_truth, truth_path(session_file))
    return truth_path(session_file)


def _run_demo(out: Path, force: bool, people: People, *, fix_time: float, **synthetic_options: Any) -> "RunResult":
    from replay.engine import compute
    from replay.running.runner import with_measured_fixes, write_watched
    from replay.show.results.run_folder import check_target
    from sessions import read_session

    check_target(out, force=force)
    progress = TerminalProgress(people)
    with temporary_folder() as folder:
        session_file = folder / SESSION_FILE
        with progress.stage("Making up the session"):
            planted_truth = _write_made_up_session(session_file, **synthetic_options)
        session = read_session(session_file)
        result = compute(session, seed=synthetic_options["seed"], fix_time=fix_time, progress=progress)
        result = with_measured_fixes(result, progress)
        write_watched(
            result,
            out,
            progress,
            force=force,
            picture=True,
            files={SESSION_FILE: session_file, planted_truth.name: planted_truth},
        )
    return replace(result, out=out)


NO_EFFECT: Final = "in its model the detector has no effect on the answers"
BRIEF_EFFECT: Final = (
    "in its model students who find it hard touch more often, but so briefly that colliders at 50 Hz miss some touches"
)
"""What is true of a made-up class, as the end of a sentence."""


def _demo_class(out: Path, students: int, *, brief: bool, seed: int, jobs: int, people: People) -> int:
    """Make up a class, replay its sessions, analyse it, all in one folder; killed, it goes on where it stopped."""
    from replay.cli.study import PageRequest, require_extra, write_page
    from replay.running.batch import run_batch
    from replay.studies.class_study.page import Heading
    from replay.studies.class_study.synthetic_class import (
        CODEBOOK_FILE,
        QUESTIONNAIRE_FILE,
        SESSIONS_FOLDER,
        make_class,
    )

    require_extra()
    people.say(f"making up {students} students and recording their sessions ...")
    failed_sessions = make_class(
        out, students=students, seed=seed, brief=brief, jobs=jobs, on_done=progress_counter(people, students)
    )
    files = sorted((out / SESSIONS_FOLDER).glob("*.mcap"))
    people.say(f"replaying {len(files)} sessions ...")
    settings = {"seed": 0, "picture": False}  # the usual detectors, as the demo asks
    batch = run_batch(files, out / "runs", jobs=jobs, settings=settings, on_done=progress_counter(people, len(files)))
    made_up_note = f"This class is made up; {BRIEF_EFFECT if brief else NO_EFFECT}."
    request = PageRequest(out / "runs", questionnaire=out / QUESTIONNAIRE_FILE, codebook=out / CODEBOOK_FILE, seed=seed)
    write_page(request, out / "study", people=people, heading=Heading("A made-up class", made_up_note), force=True)
    return EXIT_DATA_LOSS if [*failed_sessions, *batch.failed] else EXIT_OK
