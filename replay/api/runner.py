"""``replay.run``: a session, or the path of one, in; a result, and on request a run folder, out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from replay.base.progress import Progress, Silent
from replay.comparison.tolerance import TAU
from replay.detection.detector_spec import SpecLike, SpecsLike
from replay.pipeline.engine import compute
from replay.pipeline.run_result import RunResult
from replay.prepare.assemble import Pairs
from replay.prepare.noise import COPIES
from replay.prepare.policy import Policy, PolicyLike
from sessions import Session


def run(
    session_or_path: Session | str | Path, *, detectors: SpecsLike | None = None, oracle: SpecLike | None = None,
    scene: str | Path | None = None, out: str | Path | None = None, pairs: Pairs | None = None,
    start: float | None = None, end: float | None = None,
    seed: int = 0, faces: bool = False, tau: float = TAU, policy: PolicyLike | Policy | None = None,
    picture: bool = True,
    noise: Sequence[str] | str = (), noise_copies: int = COPIES,
    force: bool = False, progress: Progress | None = None, request: str = "",
) -> RunResult:  # fmt: skip
    """Replay a session through detectors, audit them against the one you trust, and write the result.

    Parameters
    ----------
    session_or_path : a session, or the file of one.
    detectors : ``"hybrid"``, ``"slow=discrete[rate_hz=22.5]"``, ``("discrete", {"rate_hz": 22.5})``, several in a
        sequence, or a mapping from label to one; ``None``: what the scene's plan calls for; ``()``: effects only.
    oracle : the detector to trust: a label among ``detectors`` or one of its own; ``None``: ``exact``; ``"none"``: no
        audit.
    scene : file of a scene that stands in place of the session's own; ``None``: that one.
    out : run folder to write; ``None``: nothing is written.
    pairs : pairs of body names; ``None``: the scene's, else all that move against each other.
    start, end : seconds after the first frame.
    seed : of every random stream.
    faces : compare faces too, at the price of a second pass of every audited detector off the clock.
    tau : metres; a disagreement about less is *within tolerance*.
    policy : what is done with poses in doubt: ``["frozen=drop", "tracking-lost=interpolate:0.2"]`` or a mapping;
        ``None``: the defaults of ``replay.prepare.policy``.
    picture : whether the run folder holds the recording for Rerun.
    noise : ``"vive"``, ``"measured"`` or ``"0.3 mm, 0.05 deg, 0.1 s"``, of one body ``"beaker=vive"``, or several: ask
        ``noise_copies`` noisy copies of the recording which contacts of the oracle hold in spite of it.
    force : replace an earlier run folder.
    progress : receives reports of how far the work is.
    request : kept in the summary; by it a batch knows the run folders that it need not make again.

    Raises ``ReplayError``, ``SessionError``, ``CollisionCoreError``: one sentence that says what to do.
    """
    progress = progress or Silent()
    target = None if out is None else Path(out)
    if target is not None:
        from replay.outputs.results.run_folder import check_target

        check_target(target, force=force)
        if picture:
            import replay.outputs.rerun_log  # noqa: F401  # before the work: whether this Rerun can draw it
    session = opened(session_or_path, scene)
    result = compute(
        session, detectors=detectors, oracle=oracle, pairs=pairs, start=start, end=end, seed=seed, faces=faces,
        tau=tau, policy=policy, noise=noise, noise_copies=noise_copies, progress=progress, out=target,
    )  # fmt: skip
    if request:
        result = replace(result, summary={**result.summary, "request": request})
    if target is not None:
        with progress.stage("write"):
            write(result, target, force=force, picture=picture)
    return result


def opened(given: Session | str | Path, scene: str | Path | None) -> Session:
    """A session, or the one in a file, with a scene in place of its own where one is given."""
    if not isinstance(given, Session):
        from sessions import read_session

        return read_session(Path(given), scene=scene)
    if scene is None:
        return given
    from sessions.scene_files.scene_meshes import with_scene

    return with_scene(given, scene)


def write(
    result: RunResult, target: Path, *, force: bool, picture: bool = True,
    files: Mapping[str, Path] | None = None,
) -> None:  # fmt: skip
    """Write the run folder of a result, with the recording for Rerun if ``picture``; as ``write_run_folder``."""
    from replay.outputs.results.run_folder import write_run_folder

    if picture:
        from replay.outputs.rerun_log.recording import write_recording

    write_run_folder(result, target, force=force, picture=write_recording if picture else None, files=files)
