"""The tables on disk: JSON, pictures, one page that needs no other file, a recording for Rerun, the calibration."""

from __future__ import annotations

import io
import json
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore.numerics import place_points
from replay.paper.calibration import SHARES, write_calibration
from replay.paper.experiment import PaperResult
from replay.paper.printed import OURS, PRINTED, TABLE_1
from replay.paper.tables import PaperTable, shown
from replay.report.markup import Markup, element, joined, picture, table

TITLE: Final = "The paper's tables, regenerated"
RED: Final = (220, 40, 40)


def write_paper(result: PaperResult, out: Path) -> list[Path]:
    """Write all files below ``out``; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    written = [out / "calibration.json", out / "paper.json"]
    write_calibration(result.calibration, written[0])
    text = json.dumps(as_json(result), indent=1, allow_nan=False) + "\n"
    _put(written[1], text.encode())
    drawn = {"table_1.png": _table_one_picture(result), "accuracy.png": _accuracy_picture(result)}
    drawn["times.png"] = _bars(result, "F7c", "median, ms", "ms, all faces of a pose", log=True)
    drawn["random_collisions.png"] = _rates_picture(result)
    for name, png in drawn.items():
        _put(out / name, png)
    _put(out / "paper.html", page(result, drawn).encode())
    _record(result, out / "paper.rrd")
    return [*written, *(out / name for name in drawn), out / "paper.html", out / "paper.rrd"]


def as_json(result: PaperResult) -> dict[str, Any]:
    """Everything as plain data: experiment, fixtures, tables."""
    return {
        "version": 1,
        "experiment": result.experiment,
        "hard_fixtures": result.hard,
        "fixtures": [one.record for one in result.fixtures],
        "tables": [one.as_json() for one in result.tables],
    }


def page(result: PaperResult, drawn: dict[str, bytes]) -> str:
    """The page as text: pictures, then every table."""
    style = Markup(files("replay.report").joinpath("style.css").read_text(encoding="utf-8"))
    parts = [picture(png, name.removesuffix(".png").replace("_", " ")) for name, png in drawn.items()]
    for one in result.tables:
        rows = [[shown(cell) for cell in row] for row in one.rows]
        parts.append(element("section", element("h2", f"{one.key}: {one.title}"), table(one.note, one.head, rows)))
    head = joined([Markup('<meta charset="utf-8">'), element("title", TITLE), Markup(f"<style>{style}</style>")])
    told = f"{len(result.fixtures)} fixtures, seed {result.experiment['seed']}; {result.hard} where FCL rounds wrongly."
    body = joined([element("header", element("p", told), element("h1", TITLE)), element("main", joined(parts))])
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>{body}</body></html>\n'


def _put(path: Path, content: bytes) -> None:
    partial = path.with_name(path.name + ".part")
    partial.write_bytes(content)
    partial.replace(path)


def _axes(width: float = 9.0, height: float = 4.5) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=100, layout="constrained")
    axes = figure.add_subplot()
    axes.grid(True, alpha=0.3)
    return figure, axes


def _png(figure: Any) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _named(result: PaperResult, key: str) -> PaperTable:
    return next(one for one in result.tables if one.key == key)


def _table_one_picture(result: PaperResult) -> bytes:
    figure, axes = _axes()
    targets = result.experiment["targets"]
    for number, name in enumerate(OURS):
        rows = [row for row in _named(result, "Table I").rows if str(row[1]).split(" ")[0] == name]
        colour = f"C{number}"
        axes.plot(targets, [row[3] for row in rows], "o-", color=colour, label=f"{name}, to completion")
        axes.plot(targets, [row[5] for row in rows], "s--", color=colour, label=f"{name}, B = {SHARES[1]:g}")
        values = [TABLE_1[name].get(target, np.nan) for target in targets]
        axes.plot(targets, values, "x:", color=colour, alpha=0.6, label=f"{OURS[name]}: {PRINTED}")
    axes.set_xlabel("faces that intersect")
    axes.set_ylabel("faces detected, mean")
    axes.legend(fontsize=7)
    return _png(figure)


def _accuracy_picture(result: PaperResult) -> bytes:
    figure, axes = _axes()
    for name in dict.fromkeys(_named(result, "F7ab").column("algorithm")):
        rows: list[Any] = [row for row in _named(result, "F7ab").rows if row[0] == name]
        low, high = [row[3] - row[4] for row in rows], [row[5] - row[3] for row in rows]
        axes.errorbar([row[1] for row in rows], [row[3] for row in rows], (low, high), capsize=3, label=str(name))
    axes.set_xscale("log", base=2)
    axes.set_xlabel("wall time, medians of hybrid")
    axes.set_ylabel("accuracy: face recall, mean with 95 % interval")
    axes.legend(fontsize=7)
    return _png(figure)


def _bars(result: PaperResult, key: str, heading: str, label: str, *, log: bool) -> bytes:
    figure, axes = _axes()
    one = _named(result, key)
    axes.barh([str(cell) for cell in one.column("algorithm")], one.column(heading), log=log)
    axes.set_xlabel(label)
    return _png(figure)


def _rates_picture(result: PaperResult) -> bytes:
    figure, axes = _axes(9.0, 6.0)
    rows: list[Any] = list(_named(result, "F7e").rows)
    names = [f"{row[1]}, {row[0]}" for row in rows]
    low, high = [max(0.0, row[4] - row[5]) for row in rows], [max(0.0, row[6] - row[4]) for row in rows]
    axes.errorbar([row[4] for row in rows], names, xerr=(low, high), fmt="o", capsize=3)
    axes.set_xlabel("share of colliding poses detected, with Wilson interval")
    return _png(figure)


def _record(result: PaperResult, path: Path) -> None:
    """Faces that meet in the first pose of each column, and accuracy, along a timeline of columns."""
    import rerun as rr

    recording = rr.RecordingStream("vrlab-replay paper")
    partial = path.with_name(path.name + ".part")
    recording.save(partial)
    for group in result.groups:
        recording.set_time("faces_that_intersect", sequence=group.target)
        for body, thing in enumerate(group.bodies):
            points = place_points(
                thing.mesh.vertices, group.motion.rotations[0, body], group.motion.translations[0, body]
            )
            where: list[object] = ["fixtures", group.family, thing.name]
            recording.log(where, rr.Mesh3D(vertex_positions=points, triangle_indices=thing.mesh.faces))
            red = thing.mesh.faces[np.unique(group.truth[0][:, body])]
            mesh = rr.Mesh3D(vertex_positions=points, triangle_indices=red, albedo_factor=RED)
            recording.log([*where, "faces that meet"], mesh)
    for share, answers in result.table_one.equal.items():
        for name, row in answers.items():
            for target in result.experiment["targets"]:
                recalls = [one.face_recall for at, one in row if at == target]
                recording.set_time("faces_that_intersect", sequence=target)
                recording.log(["accuracy", f"B {share:g}", name], rr.Scalars(float(np.mean(recalls))))
    recording.disconnect()
    partial.replace(path)
