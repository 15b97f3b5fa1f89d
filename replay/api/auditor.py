"""``replay.audit``: sessions in, what each detector missed and invented in all of them out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from replay.base.processes import OnDone
from replay.base.progress import Progress
from replay.comparison.tolerance import TAU
from replay.detection.detector_spec import SpecLike, SpecsLike
from replay.errors import AuditError
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import pool
from replay.prepare.assemble import Pairs
from replay.prepare.noise import COPIES
from replay.prepare.policy import Policy, PolicyLike
from sessions import Session

SessionLike: TypeAlias = Session | str | Path


@dataclass(frozen=True, eq=False)
class AuditResult:
    """The outcome of ``replay.audit``.

    Parameters
    ----------
    results : one run per session, in the order given; each holds all detectors.
    summary : label -> figures of ``replay.pipeline.scores`` summed over the sessions, with intervals of the sums.
    """

    results: tuple[RunResult, ...]
    summary: Mapping[str, Any]


def audit(
    sessions: SessionLike | Sequence[SessionLike], *, detectors: SpecsLike | None = None,
    oracle: SpecLike | None = None, scene: str | Path | None = None, out: str | Path | None = None,
    pairs: Pairs | None = None, start: float | None = None, end: float | None = None, seed: int = 0,
    faces: bool = True, tau: float = TAU, policy: PolicyLike | Policy | None = None, picture: bool = True,
    log_search: bool = False, offline: bool = False, noise: Sequence[str] | str = (), noise_copies: int = COPIES,
    force: bool = False, progress: Progress | None = None, jobs: int = 1, scheduler: str | None = None,
    on_done: OnDone | None = None,
) -> AuditResult:  # fmt: skip
    """Compare detectors with an oracle over one or several sessions: pair-frames, contacts matched one to one, faces.

    Parameters
    ----------
    sessions : a session or the file of one, or several; files, and ``out``, may be URLs of fsspec.
    detectors, oracle : as ``replay.run``; an oracle is needed.
    out : run folder to write; with several sessions the folder that gets a run folder for each, named after its file.
    scene, pairs, start, end, seed, policy, picture, log_search, offline, noise, noise_copies, force, progress : as
        ``replay.run``.
    faces : compare faces too, at the price of a second pass of every audited detector off the clock.
    tau : metres; a disagreement about less is *within tolerance*.
    jobs : processes for several sessions, without ``progress`` then; times are those of a busy machine, and results
        lack detectors, intersection segments and ``watched``.
    scheduler : address of a scheduler of Dask whose workers do it, or ``local``, as ``replay.api.batch.run_batch``.
    on_done : called with the name of a session when a process has finished it.

    Raises ``AuditError``: no session, no oracle, or two sessions that would share a run folder; ``ReplayError``,
    ``SessionError``, ``CollisionCoreError``: one sentence that says what to do; ``WorkerError``: a session ended its
    process each time, or workers cannot be used.

    Examples
    --------
    >>> from replay import audit
    >>> audit("session.mcap", detectors="hybrid-qaco").summary  # doctest: +SKIP
    """
    from replay.api.batch import run_near, run_side_by_side
    from replay.api.places import check_place, place

    several = [sessions] if isinstance(sessions, Session | str | Path) else list(sessions)
    given = [one if isinstance(one, Session) else place(one) for one in several]
    if not given:
        raise AuditError("there is no session to audit; name at least one")
    if oracle == "none":
        raise AuditError("an audit needs an oracle to compare with; leave oracle out for the exact one")
    folders = _folders(given, None if out is None else place(out))
    for folder in folders:
        check_place(folder, force=force)
    settings: dict[str, Any] = {
        "detectors": detectors, "oracle": oracle, "scene": scene, "pairs": pairs, "start": start, "end": end,
        "seed": seed, "faces": faces, "tau": tau, "policy": policy, "picture": picture, "log_search": log_search,
        "offline": offline, "noise": noise, "noise_copies": noise_copies, "force": force,
    }  # fmt: skip
    asked = [(session, {**settings, "out": folder}) for session, folder in zip(given, folders, strict=True)]
    if scheduler or (jobs > 1 and len(given) > 1):
        origins = _origins(given)
        names = [one if origins.count(one) == 1 else f"{one} ({k})" for k, one in enumerate(origins, 1)]
        results = run_side_by_side(dict(zip(names, asked, strict=True)), jobs, on_done, scheduler)
    else:
        results = tuple(run_near(session, {**one, "progress": progress}) for session, one in asked)
    return AuditResult(results, pool(result.summary["audit"] for result in results))


def _origins(given: Sequence[SessionLike]) -> list[str]:
    return [session.origin if isinstance(session, Session) else str(session) for session in given]


def _folders(given: Sequence[SessionLike], out: Path | None) -> list[Path | None]:
    if out is None or len(given) == 1:
        return [out] * len(given)
    names = [Path(origin).stem or f"session-{number}" for number, origin in enumerate(_origins(given), 1)]
    twice, count = Counter(names).most_common(1)[0]
    if count > 1:
        raise AuditError(
            f"two sessions are called {twice!r} and would share a run folder; rename one or audit it alone"
        )
    return [out / name for name in names]
