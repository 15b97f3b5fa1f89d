"""``replay.audit``: ``replay.run`` of one session or several, its figures summed, and held to limits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from replay.document.audit import DetectorAudit
from replay.document.gates import Gates, times_of
from replay.document.scores import pooled_audits
from replay.errors import AuditError
from replay.running.run_result import RunResult
from sessions import Session

SessionLike: TypeAlias = Session | str | Path


@dataclass(frozen=True, eq=False)
class AuditResult:
    """The outcome of ``replay.audit``.

    Parameters
    ----------
    results : one run per session, in the order given; each holds all detectors.
    audit : label -> counts summed over the sessions, with intervals of the sums.
    broken : a sentence for each limit that was exceeded or could not be checked.
    """

    results: tuple[RunResult, ...]
    audit: Mapping[str, DetectorAudit]
    broken: tuple[str, ...] = ()


def audit(
    sessions: SessionLike | Sequence[SessionLike],
    *,
    out: str | Path | None = None,
    max_missed: float | None = None,
    max_false: float | None = None,
    max_p99_ms: float | None = None,
    max_missed_depth: float | None = None,
    **options: Any,
) -> AuditResult:
    """Run sessions beside an oracle, and hold what came of all of them to limits.

    Parameters
    ----------
    sessions : a session or the file of one, or several; files, and ``out``, may be URLs of fsspec.
    out : run folder to write; with several sessions the folder that gets a run folder for each, named after its file.
    max_missed, max_false : shares from 0 to 1; max_p99_ms : milliseconds;
        max_missed_depth : metres. As ``replay.document.gates.Gates``.
    options : as ``replay.run``; an oracle is needed.

    Raises ``AuditError``: no session, no oracle, a limit that is none, or two sessions that would share a run folder;
    ``ReplayError``, ``SessionError``, ``CollisionCoreError``: one sentence that says what to do.

    Examples
    --------
    >>> from replay import audit
    >>> audit("session.mcap", detectors="hybrid-qaco", max_missed=0.01).broken  # doctest: +SKIP
    """
    from replay.prepare.session_input import require_session
    from replay.running.remote_files import path_of_place, store_errors
    from replay.running.runner import run
    from replay.show.results.run_folder import check_target

    limits = Gates(max_missed, max_p99_ms, max_false, max_missed_depth)
    session_list = list(sessions) if isinstance(sessions, Sequence) and not isinstance(sessions, str) else [sessions]
    for given_session in session_list:
        require_session(given_session)
    if not session_list:
        raise AuditError("there is no session to audit; name at least one")
    if options.get("oracle") == "none":
        raise AuditError("an audit needs a reference to compare with; leave oracle out for the exact one")
    folders = _session_folders(session_list, None if out is None else path_of_place(out))
    for folder in filter(None, folders):
        with store_errors(folder):
            check_target(folder, force=options.get("force", False))
    results = [run(session, out=folder, **options) for session, folder in zip(session_list, folders, strict=True)]
    audit_of_label = pooled_audits(result.document.audit for result in results)
    broken_limits = limits.broken_limits(audit_of_label, times_of(result.document for result in results))
    return AuditResult(tuple(results), audit_of_label, tuple(broken_limits))


def _session_folders(sessions: Sequence[SessionLike], out: Path | None) -> list[Path | None]:
    if out is None or len(sessions) == 1:
        return [out] * len(sessions)
    origins = [session.origin if isinstance(session, Session) else str(session) for session in sessions]
    folder_names = [Path(origin).stem or f"session-{number}" for number, origin in enumerate(origins, 1)]
    most_common_name, count = Counter(folder_names).most_common(1)[0]
    if count > 1:
        raise AuditError(
            f"two sessions are called {most_common_name!r} and would share a run folder; rename one or audit it alone"
        )
    return [out / name for name in folder_names]
