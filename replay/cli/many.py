"""Several sessions, a run folder each: what ``run`` does with them and says of them."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from replay.cli.console import DATA_LOSS, OK, People, counting
from replay.cli.run_report import answer_cited, lost_frames, lost_poses

if TYPE_CHECKING:
    from replay.api.batch import Batch
    from replay.outputs.tables import Table
    from replay.pipeline.gates import Gates

SESSION_ROWS: Final = 20

RARE: Final = ("undecided", "frames left out", "poses left out")
"""Columns that are there only where there is something to count; *undecided* adds up over the detectors."""


def run_many(
    files: Sequence[Path], out: Path | None, people: People, *, settings: Mapping[str, Any], limits: "Gates",
    as_json: bool = False, as_markdown: bool = False, **how: Any,
) -> int:  # fmt: skip
    """Run sessions as ``run_batch`` does, ``how`` it is asked; print figures over all of them; the exit code.

    Without ``out`` the run folders are made where nobody looks, and are gone afterwards.
    """
    from replay.api.batch import run_batch
    from replay.cli.run_tables import audit_table
    from replay.cli.terminal import terminal

    with ExitStack() as kept:
        if out is None:
            folder, settings = Path(kept.enter_context(TemporaryDirectory(prefix="replay-"))), dict(settings)
            settings["picture"] = False
        else:
            folder = out

        def died(name: str, worker: str) -> None:
            people.say(f"the worker {worker} ended while it replayed {name}, which is asked again")

        how |= {"on_done": counting(people, len(files)), "on_died": died}
        batch = run_batch(files, folder, settings=settings, **how)
    broken = limits.broken(batch.audit, [*batch.runs.values()])
    plain = {name: getattr(batch, name) for name in ("done", "kept", "failed", "digest", "audit")}
    tables = [audit_table(batch.audit)] if batch.audit else []
    tables += [session_table(batch)] if batch.runs else []
    where = "were replayed; with --out DIR each gets a run folder" if out is None else f"are in {out}"
    lines = ["", f"{len(batch.done)} of {len(files)} sessions {where}"]
    lines += [f"failed: {name}: {why}" for name, why in batch.failed.items()]
    lines.append(f"digest: {batch.digest or 'none, sessions failed'}")
    if as_markdown:
        from replay.cli.run_markdown import batch_markdown

        print(batch_markdown(f"{len(files)} sessions", broken, lines, tables[-1:]))
        return people.gate(broken, DATA_LOSS if batch_lost(batch) else OK)
    told = {"out": None if out is None else str(out), **plain, "broken": broken}
    answer_cited(as_json, told, lambda: terminal(*tables), {}, lines)
    return people.gate(broken, DATA_LOSS if batch_lost(batch) else OK)


def batch_lost(batch: "Batch") -> bool:
    """Whether a session failed, or frames or poses of one were left out."""
    return bool(batch.failed) or any(lost_frames(one) or lost_poses(one) for one in batch.runs.values())


def session_table(batch: "Batch") -> "Table":
    """A row per session that is done, the one with the most missed contacts first; sums over all in the last row."""
    from replay.outputs.tables import IN_RED, WARNING, table

    missed = {f"missed by {label}": label for label in batch.audit}
    rows = {name: _counts(run, missed) for name, run in batch.runs.items()}
    rare = [name for name in RARE if any(row[name] for row in rows.values())]
    names = ["frames", *(["contacts", *missed] if missed else []), *rare]
    order = sorted(rows, key=lambda one: (-sum(rows[one][name] for name in missed), one))
    return table(
        "sessions, the most missed contacts first" if missed else "sessions", ["session", *names],
        [(one, *(rows[one][name] for name in names)) for one in order[:SESSION_ROWS]]
        + [("all", *(sum(row[name] for row in rows.values()) for name in names))],
        marks=dict.fromkeys(missed, IN_RED) | dict.fromkeys(rare, WARNING),
        notes=[f"… and {len(order) - SESSION_ROWS} more"] if len(order) > SESSION_ROWS else [],
    )  # fmt: skip


def _counts(run: Mapping[str, Any], missed: Mapping[str, str]) -> dict[str, int]:
    """What a row of the table says of a run; the contacts are the oracle's, the same beside every detector."""
    of = [run["audit"][label] for label in missed.values() if label in run["audit"]]
    lost = (lost_frames(run), lost_poses(run))
    undecided = sum(one["contacts_undecided"] for one in of)
    counts = {"frames": run["session"]["frames"], "contacts": of[0]["contacts"] if of else 0}
    found = {name: run["audit"][label]["contacts_missed"] for name, label in missed.items() if label in run["audit"]}
    return dict.fromkeys(missed, 0) | counts | found | dict(zip(RARE, (undecided, *lost), strict=True))
