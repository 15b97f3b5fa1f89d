"""The tables on disk: JSON, pictures, one page that needs no other file, a recording for Rerun, the calibration."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from replay.outputs.report.markup import Markup, element, joined, page_table, picture
from replay.outputs.rerun_log.paper_recording import record
from replay.studies.paper.calibration import put, write_calibration
from replay.studies.paper.experiment import PaperResult
from replay.studies.paper.pictures import pictures_of
from replay.studies.paper.printed import PRINTED
from replay.studies.paper.verdict import verdict_of

TITLE: Final = "The paper's tables, regenerated"


def write_paper(result: PaperResult, out: Path) -> list[Path]:
    """Write all files below ``out``; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    written = [out / "calibration.json", out / "paper.json"]
    write_calibration(result.calibration, written[0])
    put(written[1], json.dumps(as_json(result), indent=1, allow_nan=False) + "\n")
    drawn = pictures_of(result.tables)
    for name, png in drawn.values():
        put(out / name, png)
    put(out / "paper.html", page(result, drawn))
    partial = out / "paper.rrd.part"
    record(result, drawn, partial)
    partial.replace(out / "paper.rrd")
    return [*written, *(out / name for name, _ in drawn.values()), out / "paper.html", out / "paper.rrd"]


def as_json(result: PaperResult) -> dict[str, Any]:
    """Everything as plain data: verdict, experiment, fixtures, tables."""
    return {
        "version": 2,
        "verdict": verdict_of(result.tables),
        "experiment": result.experiment,
        "hard_fixtures": result.hard,
        "fixtures": [one.record for one in result.fixtures],
        "tables": [one.as_json() for one in result.tables],
    }


def page(result: PaperResult, drawn: Mapping[str, tuple[str, bytes]]) -> str:
    """The page as text: what the tables say, then every table below its picture."""
    style = Markup(files("replay.outputs.report").joinpath("style.css").read_text(encoding="utf-8"))
    said = element("ul", *(element("li", sentence) for sentence in verdict_of(result.tables)))
    parts = [element("section", element("h2", "What the tables say"), said)]
    for one in result.tables:
        shape = [picture(drawn[one.key][1], one.title)] if one.key in drawn else []
        cells = page_table(replace(one.plain, title=one.note, notes=()))
        parts.append(element("section", element("h2", f"{one.key}: {one.title}"), *shape, cells))
    head = joined(
        [
            Markup('<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'),
            element("title", TITLE),
            Markup(f"<style>{style}</style>"),
        ]
    )
    body = joined(
        [element("header", element("p", _told(result)), element("h1", TITLE)), element("main", joined(parts))]
    )
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>{body}</body></html>\n'


def _told(result: PaperResult) -> str:
    """How much was run, on which machine the times were taken, and what printed values are."""
    size, machine = result.experiment, result.calibration.machine
    where = machine.get("processor")
    return (
        f"{len(result.fixtures)} poses of Table I ({result.hard} in which FCL rounds wrongly), {size['near']:,} random "
        f"poses of each family, {size['sessions']} sessions, seed {size['seed']}; times of {where}, "
        f"{machine.get('cores')} cores. What the paper printed stands only below: {PRINTED}."
    )
