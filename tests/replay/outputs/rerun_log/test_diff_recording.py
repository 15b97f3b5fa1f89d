"""Two runs under one cursor: lanes, list and eyes are those of what differs, and each close-up has its own faces."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cubes

from replay import run
from replay.cli.main import main
from replay.errors import RunFolderError
from replay.outputs.palette import FOUND, MISSED
from replay.outputs.rerun_log.columns import packed
from replay.outputs.rerun_log.overview import read_moments
from replay.outputs.rerun_log.viewer import _target
from replay.studies.diff.diff_folder import write_diff
from replay.studies.diff.diff_words import changes, headline, most_first
from replay.studies.diff.runs import diff_runs

PLACES = {"a": [0] * 40, "b": [3, 3, *[0.9] * 6, *[3] * 5, 0.9, *[3] * 7, *[0.9] * 9, *[3] * 10]}
"""The second contact is of one frame, 13: every fourth frame does not see it."""


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    at = tmp_path_factory.mktemp("runs")
    for name, rate in (("before", 25), ("after", 100)):
        run(cubes(PLACES), detectors=f"slow=discrete[rate_hz={rate}]", oracle="hybrid", out=at / name)
    run(cubes(PLACES), detectors="slow=discrete[rate_hz=25]", oracle="hybrid", out=at / "bare", picture=False)
    run(cubes(PLACES), detectors="slow=discrete[rate_hz=25]", oracle="hybrid", out=at / "short", end=0.2)
    return at


@pytest.fixture(scope="module")
def found(folders):
    return diff_runs(folders / "before", folders / "after")


@pytest.fixture(scope="module")
def seen(folders, reader):
    assert main(["diff", str(folders / "before"), str(folders / "after"), "-o", str(folders / "diff"), "-q"]) == 0
    return reader(folders / "diff" / "run.rrd")


def test_changes_are_numbered_in_order_of_time_and_listed_by_kind(found):
    one = changes(found.detectors["slow"])
    assert [each.number for each in one] == list(range(1, len(one) + 1))
    assert [each.start for each in one] == sorted(each.start for each in one)
    (gained,) = [each for each in one if each.kind == "gained"]
    assert gained.start == pytest.approx(0.13) and gained.words.startswith("gained  a - b at 0.130 s, 1 frame")
    kinds = [each.kind for each in most_first(one)]
    assert kinds == sorted(kinds) and set(kinds) == {"gained", "shifted"}
    shifts = [each.moved for each in most_first(one) if each.kind == "shifted"]
    assert shifts == sorted(shifts, reverse=True)
    shifted = f"{len(shifts)} contact{'s' * (len(shifts) > 1)} shifted"
    assert headline(found) == f"slow: 1 contact gained, {shifted}; {found.detectors['slow'].same} the same"
    assert headline(replace(found, detectors={})) == "No contact changed"


def test_lanes_hold_the_contacts_of_both_and_the_number_of_every_change(found, seen):
    one = changes(found.detectors["slow"])
    for k, kind in ((3, "gained"), (4, "lost"), (5, "shifted")):
        numbers = {each.number for each in one if each.kind == kind}
        ends = [
            [int(part) for part in state.split("-")] for _, state in seen.lane(f"diff/slow/lanes/{k}_{kind}") if state
        ]
        assert numbers <= {number for some in ends for number in range(some[0], some[-1] + 1)}
        assert bool(ends) == bool(numbers)
    after = [ns for ns, state in seen.lane("diff/slow/lanes/2_after") if state == "contact"]
    assert after == [20_000_000, 130_000_000, 210_000_000]
    assert len([state for _, state in seen.lane("diff/slow/lanes/1_before") if state]) == 2


def test_each_side_has_the_faces_of_its_own_run_and_the_room_stands_once(seen):
    missed = [path for path in seen.entities if "missed_faces" in path]
    assert sorted(missed) == ["/world/a/before_missed_faces", "/world/b/before_missed_faces"]
    contacts = {path for path in seen.entities if path.startswith("/world/contacts")}
    assert {"/world/contacts/before/slow", "/world/contacts/after/slow"} <= contacts
    assert {"/world/contacts/before/hybrid/section", "/world/contacts/after/hybrid/section"} <= contacts
    assert {"/world/a/mesh", "/world/b/mesh"} <= set(seen.entities)
    shades = [
        seen.at_ns(f"world/contacts/{side}/hybrid", "Points3D:colors", 130_000_000)[0] for side in ("before", "after")
    ]
    assert shades == packed([MISSED, FOUND]).tolist()


def test_a_line_leads_to_its_change_and_the_eye_looks_at_it(found, seen, folders):
    for each in changes(found.detectors["slow"]):
        ns = round(each.start * 1e9)
        assert seen.at_ns("diff/slow/list", "TextLog:text", ns) == [f"{each.number:>3}  {each.words}"]
        (eye,) = seen.at_ns("world/diff/slow/eye", "Transform3D:translation", ns)
        point = seen.column("world/diff/slow/pins", "Points3D:positions")[0][2][each.number - 1]
        assert np.linalg.norm(np.subtract(eye, point)) == pytest.approx(0.25, abs=1e-5)
    (place,) = read_moments(folders / "diff" / "run.rrd")
    assert place.leads and _target(folders / "diff" / "run.rrd", None, None, "") == place.session_ns == 130_000_000


def test_the_folder_holds_the_figures_and_is_replaced_only_when_asked(folders, seen, capsys):
    told = json.loads((folders / "diff" / "diff.json").read_text())
    assert told["changed"] and told["files"] == ["diff.json", "run.rrd"] and told["runs"] == ["before", "after"]
    words = ["diff", str(folders / "before"), str(folders / "after"), "-o", str(folders / "diff"), "-q"]
    assert main(words) == 1 and "replace it with --force" in capsys.readouterr().err
    assert main([*words, "--force"]) == 0


@pytest.mark.parametrize(
    ("other", "words"), [("bare", "holds no picture"), ("short", "hold other frames, .* leave out --out")]
)
def test_what_cannot_lie_under_one_cursor_is_refused_in_a_sentence(folders, tmp_path, other, words):
    found = diff_runs(folders / "before", folders / other, different_sessions=True)
    with pytest.raises(RunFolderError, match=words):
        write_diff(found, (folders / "before", folders / other), tmp_path / "out", {})
    assert not (tmp_path / "out").exists()
