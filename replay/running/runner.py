"""``replay.run``: a session, or the path of one, in; a result, and on request a run folder, out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from msgspec import structs

from replay.detection.progress import Progress, Silent
from replay.document import run_result
from replay.engine import compute
from replay.prepare.session_input import require_session
from replay.running.remote_files import local_copy, path_of_place, run_folder_for, store_errors
from replay.running.run_result import RunResult
from replay.settings import RunSettings
from sessions import Session

WRITING_STAGE: Final = "Writing report and picture"
WRITING_STEPS: Final = 20
"""Steps of progress of a run folder: its tables, the picture, the report."""


def run(
    session_or_path: Session | str | Path,
    settings: RunSettings | None = None,
    *,
    scene: str | Path | None = None,
    out: str | Path | None = None,
    picture: bool = True,
    force: bool = False,
    progress: Progress | None = None,
    request: str = "",
    **changes: Any,
) -> RunResult:
    """Replay a session through detectors, audit them against the one you trust, and write the result.

    Parameters
    ----------
    session_or_path : a session, or the file of one; the file, and ``out``, may be URLs of fsspec.
    settings : what is asked; ``None``: the usual detectors about the whole recording.
    scene : file of a scene that stands in place of the session's own; ``None``: that one.
    out : run folder to write; ``None``: nothing is written.
    picture : whether the run folder holds the recording for Rerun.
    force : replace an earlier run folder.
    progress : receives reports of how far the work is.
    request : kept in the summary; by it a batch knows the run folders that it need not make again.
    changes : fields of ``RunSettings``, in place of those of ``settings``: ``detectors``, ``oracle``, ``start``, ...

    Raises ``ReplayError``, ``SessionError``, ``CollisionCoreError``: one sentence that says what to do.

    Examples
    --------
    >>> import replay
    >>> result = replay.run("session.mcap", detectors="slow=discrete[rate_hz=22.5],exact")  # doctest: +SKIP
    """
    progress = progress or Silent()
    target = None if out is None else path_of_place(out)
    if target is not None:
        from replay.show.results.run_folder import check_target

        with store_errors(target):
            check_target(target, force=force)
    with local_copy(session_or_path) as local_session:
        result = compute(open_session(local_session, scene), settings, progress=progress, **changes)
    result = with_measured_fixes(with_open_questions(result, progress), progress)
    if request:
        result = replace(result, document=structs.replace(result.document, request=request))
    if target is not None:
        result = replace(result, out=target)
        with run_folder_for(target) as folder:
            write_watched(result, folder, progress, force=force, picture=picture)
    return RunResult.of(result)


def with_open_questions(result: run_result.RunResult, progress: Progress) -> run_result.RunResult:
    """The result with the guesses of its recording's import, and of those the ones that change its contacts."""
    if not result.detections:
        return result
    from replay.advice.assumptions import first_screen_lines

    import_questions = first_screen_lines(result.session, result.assembly, progress)
    document = structs.replace(
        result.document, open_questions=tuple(import_questions.questions), guesses=tuple(import_questions.guesses)
    )
    return replace(result, document=document)


def with_measured_fixes(result: run_result.RunResult, progress: Progress) -> run_result.RunResult:
    """The result with the Fix of its colliders measured, in the time that its settings give."""
    time_limit = result.document.settings.fix_time
    if time_limit <= 0.0 or not result.answers:
        return result
    from replay.advice.measured_fix import measured_fixes

    return measured_fixes(result, time_limit, progress)


def open_session(given: Session | str | Path, scene: str | Path | None) -> Session:
    """A session, or the one in a file, with a scene in place of its own where one is given.

    Raises ``WrongInputError``: neither a session nor a path.
    """
    require_session(given)
    if not isinstance(given, Session):
        from sessions import read_session

        return read_session(Path(given), scene=scene)
    if scene is None:
        return given
    from sessions.scene_files.scene_meshes import with_scene

    return with_scene(given, scene)


def write_watched(result: run_result.RunResult, target: Path, progress: Progress, **how: Any) -> None:
    """``write_run_folder`` as a stage of its own."""
    from replay.show.results.run_folder import write_run_folder

    with progress.stage(WRITING_STAGE, WRITING_STEPS) as advance:
        write_run_folder(result, target, advance=advance, **how)
