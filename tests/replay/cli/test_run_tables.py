"""What a terminal says of a run."""

from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console
from support.small_worlds import cube, cubes

from cdcore.detectors import settings_of
from replay.cli.run_tables import run_screen, run_tables
from replay.detection.detector_spec import parse_detectors
from replay.outputs.report.page import report_html
from replay.outputs.rerun_log.documents import answer_text
from replay.pipeline.engine import compute
from sessions import MeshData

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


def printed(*shown, width=200):
    console = Console(width=width, record=True, file=StringIO())
    for one in shown:
        console.print(one)
    return console.export_text()


def text(result):
    return printed(run_tables(result), run_screen(result))


def test_a_fix_that_the_run_measured_has_the_figures_of_a_run_with_it():
    result = compute(cubes(PLACES), detectors="slow=discrete[rate_hz=20]")
    (answer,) = result.answers
    fixed = compute(cubes(PLACES), detectors="often=discrete")
    audit = fixed.summary["audit"]["often"]
    every = result.phases["slow"].every_frame
    assert answer.fix.measured and "none missed or late, 0 % false" in answer.fix.words
    assert (every.contacts_missed, every.contacts_in_part) == (audit["contacts_missed"], audit["contacts_in_part"])
    assert (every.contacts_missed, every.contacts_in_part, every.invented["count"]) == (0, 0, 0)
    assert every.invented == audit["invented"]


def test_a_fix_that_nobody_measured_says_so_and_its_command_runs():
    gap = cubes({"a": [0.0] * 6, "b": [3.0, 1.02, 1.01, 1.02, 3.0, 3.0]})
    (answer,) = compute(gap, detectors="box=collider[shape=box,skin_m=0.05]").answers
    assert not answer.fix.measured and "not measured" in answer.fix.words
    (spec,) = parse_detectors(answer.fix.command.split('"')[1])
    assert settings_of(spec.name, spec.settings).pieces == 16


@pytest.mark.parametrize(("place", "hollow"), [(0.0, True), (1.19, False)])
def test_a_hull_is_said_to_fill_a_hollow_only_where_the_other_body_is_in_it(place, hollow):
    box = cube()
    walls = [box.vertices * (0.1, 1, 1) + (x, 0, 0) for x in (-1, 1)]
    gate = MeshData(np.concatenate(walls), np.concatenate([box.faces, box.faces + len(box.vertices)]))
    away = cubes({"gate": [0.0] * 4, "ball": [3.0, place, place, 3.0]})
    session = replace(away, meshes={"gate": gate, "ball": cube(0.2)})
    (answer,) = compute(session, detectors="hull=collider[skin_m=0.04]").answers
    assert ("hull of gate fills its hollow: ball is in" in answer.why) == hollow
    assert f"{answer.moment.seconds:.1f} s" in answer.why and f"{1e3 * answer.moment.metres:.0f} mm" in answer.why


def test_what_is_suspicious_about_units_comes_before_every_answer():
    far = {"a": [0.0] * 12, "b": [3000, 3000, 3000, 3000, 0.9, 3000, 3000, 3000, 0.9, 0.8, 0.9, 3000]}
    result = compute(cubes(far), detectors="hybrid")
    first, *rest = printed(run_screen(result), width=400).splitlines()
    assert first.startswith("Warning, unit-suspect: positions look like millimetres") and "(b: 3000 m from" in first
    assert "no contact of 2 missed, none false" in " ".join(rest)
    for words in (answer_text(result), report_html(result)):
        assert words.index("unit-suspect") < words.rindex("no contact of 2 missed")
