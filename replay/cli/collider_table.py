"""``replay tradeoff --engine NAME --colliders DIR``: what was written, and what it makes of the session."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from replay.cli.console import FAILURE, OK, People, TerminalProgress, answer

if TYPE_CHECKING:
    from replay.api.collider_files import Shipped
    from replay.outputs.tables import Table


def write_colliders(
    session: Path, folder: Path, engine: str, people: People, *, as_json: bool, **asked: Any
) -> int:  # fmt: skip
    """Write the pieces and print before and after; exit code 1 where false contact stays above what was asked for."""
    from replay.api.collider_files import ship_colliders
    from replay.cli.terminal import terminal
    from replay.detection.compile_notice import compiling_announced

    with compiling_announced(people):
        shipped = ship_colliders(session, folder, engine=engine, progress=TerminalProgress(people), **asked)
    tables = [before_after(shipped), *([body_table(shipped)] if people.verbose else [])]
    answer(as_json, shipped.as_json, lambda: terminal(*tables))
    if not as_json:
        answer(False, None, lambda: sentences(shipped))
    return OK if shipped.reached else FAILURE


def before_after(shipped: "Shipped") -> "Table":
    """A hull a body, and the pieces, as ``run`` counts them."""
    from replay.outputs.tables import Column, Table
    from replay.outputs.tradeoff_table import FALSE, LATE, MISSED

    rows = [{"": "before: a hull a body", **shipped.before}, {"": "after: these pieces", **shipped.after}]
    result = shipped.result
    contacts = len(result.episodes[result.oracle])
    title = f"{contacts} contacts, {shipped.engine.name} at {shipped.engine.step_hz:g} steps a second"
    columns = (
        Column("", of=lambda row: row[""], whole=True), FALSE, MISSED, LATE, Column("pieces", int),
        Column("mean ms", float, of="ms", show=".3f"),
    )  # fmt: skip
    return Table.of(columns, rows, title)


def body_table(shipped: "Shipped") -> "Table":
    """A row a body: its file, and how far the pieces hold its mesh."""
    from replay.outputs.tables import table

    rows = [
        (row["body"], row["file"], str(row["pieces"]), str(row["triangles"]), f"{row['outside_mm']:.2f}", row["how"])
        for row in shipped.bodies
    ]
    head = ("body", "file", "pieces", "triangles at most", "mesh outside by, mm", "cut")
    return table("Convex pieces", head, rows, words=("body", "file", "cut"))


def sentences(shipped: "Shipped") -> list[str]:
    """What was reached, what the engine does with the files, and how to count it again."""
    from replay.pipeline.gates import figure

    after, limit = shipped.after, figure(100 * shipped.max_false)
    false = "0" if after["false"] is None else figure(100 * after["false"])
    lines = [f"{false} % of the contact time is false; at most {limit} % was wanted."]
    if not shipped.reached:
        lines.append("No cut that was tried makes it less: a faster step or another --max-false.")
    outside = max(row["outside_mm"] for row in shipped.bodies)
    lines.append(f"Every mesh lies within its pieces, or outside by {outside:.2f} mm at most.")
    if shipped.engine.name == "Unity":
        lines.append("As triggers they report but do not push; each piece is a Convex Mesh Collider.")
    whole = [row["body"] for row in shipped.bodies if row["how"] == "one hull"]
    if whole and find_spec("coacd") is None and not shipped.reached:
        lines.append('What is not round keeps one hull; to cut it too: pip install "vrlab-replay[engines]"')
    again = f'replay run {shipped.folder / "session.mcap"} --detectors "{shipped.setting}"'
    wrote = f"Wrote {shipped.folder}: a GLB a body, colliders.json, session.mcap. Count it again:"
    return ["", *lines, wrote, f"  {again}"]
