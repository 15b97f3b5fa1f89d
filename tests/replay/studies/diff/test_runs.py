import json
import shutil
from dataclasses import replace

import pytest
from support.report_states import tamper
from support.small_worlds import unit_cubes_on_x

from replay import run
from replay.cli.main import main
from replay.show.results.run_folder import read_run_folder
from replay.studies.diff.diff_words import change_lines
from replay.studies.diff.runs import diff_runs

# of the frames:  0    1    2    3    4    5    6    7    8    9    10   11   12   13
CUBE_B_BEFORE = [3.0, 0.9, 3.0, 3.0, 0.9, 3.0, 3.0, 3.0, 0.9, 0.8, 0.9, 3.0, 3.0, 3.0]
CUBE_B_AFTER = [3.0, 0.9, 3.0, 3.0, 3.0, 0.9, 3.0, 0.9, 0.9, 0.8, 3.0, 3.0, 0.9, 3.0]
"""Metres on X, frame by frame of 10 ms, of a cube of 1 m beside one at 0: they touch below 1 m.

The second motion lost the contact of frame 4, has that of frames 8 to 10 a frame earlier, and gained two, in frames 5
and 12.
"""


def cubes(b):
    """A session of cube a at 0 and cube b at these metres on X."""
    return unit_cubes_on_x({"a": [0.0] * len(b), "b": b})


@pytest.fixture(scope="module")
def run_folders(tmp_path_factory):
    """Run folders a, b and c without a reference: b and c replay the second motion, b with other detectors and seed.

    Detectors of b got all frames at once, so that no frame of theirs was timed alone.
    """
    at = tmp_path_factory.mktemp("runs")
    before, after, more = cubes(CUBE_B_BEFORE), cubes(CUBE_B_AFTER), {"picture": False, "oracle": "none"}
    run(before, detectors="slow=discrete[rate_hz=100],hybrid", out=at / "a", **more)
    run(after, detectors="slow=discrete[rate_hz=50],sphere,aabb", out=at / "b", seed=3, offline=True, **more)
    run(after, detectors="slow=discrete[rate_hz=100]", out=at / "c", **more)
    return at


def seconds_of_slow(folder):
    """Times of the detector slow, as the summary of a run folder has them."""
    return json.loads((folder / "summary.json").read_text())["detectors"]["slow"]["seconds"]


@pytest.fixture(scope="module")
def diff_of_slow(run_folders):
    """The detector slow, a discrete one at 100 Hz, in the runs a and c of the two motions."""
    return diff_runs(run_folders / "a", run_folders / "c", different_sessions=True).detectors["slow"]


def test_diff_finds_planted_gained_lost_and_shifted_contacts(diff_of_slow):
    """Frames of 10 ms: the contact in frame 4 is lost, in 5 and 12 two are gained, that of 8 to 10 is a frame earlier.

    The contact in frame 1 is the same in both. The one gained in frame 5 begins where that of frame 4 ended.
    """
    assert diff_of_slow.same == 1
    assert [contact.start for contact in diff_of_slow.lost] == [pytest.approx(0.04)]
    assert [contact.start for contact in diff_of_slow.gained] == pytest.approx([0.05, 0.12])
    (shift,) = diff_of_slow.shifted
    assert (shift.start, shift.end) == (pytest.approx(-0.01), pytest.approx(-0.01))
    assert diff_of_slow.same_verdicts is False


@pytest.mark.parametrize("kind", ["gained", "lost", "shifted"])
def test_any_kind_of_change_counts_as_a_change(diff_of_slow, kind):
    """Between two runs contacts were gained, lost and shifted; here of this kind alone."""
    other_kinds = {"gained", "lost", "shifted"} - {kind}
    assert replace(diff_of_slow, **dict.fromkeys(other_kinds, ())).changed


def test_times_are_ratios_of_both_summaries(run_folders, diff_of_slow):
    """Seconds of all frames, and of the frame that 99 % do not exceed: second run by first."""
    before, after = seconds_of_slow(run_folders / "a"), seconds_of_slow(run_folders / "c")
    assert diff_of_slow.time_ratio == pytest.approx(after["detect"] / before["detect"])
    assert diff_of_slow.p99_ratio == pytest.approx(after["sample_times"]["p99"] / before["sample_times"]["p99"])


def test_diff_lists_exactly_the_settings_that_differ(run_folders):
    """Run b has another seed, its ``slow`` 50 Hz in place of 100, and two detectors that a has not."""
    result = diff_runs(run_folders / "a", run_folders / "b", different_sessions=True)
    assert result.settings == {"seed": (0, 3), "slow.settings.rate_hz": (100, 50)}
    assert (result.only_a, result.only_b) == (("hybrid",), ("sphere", "aabb"))


def test_diff_of_a_run_with_itself_is_empty(run_folders):
    """Run a has slow and hybrid: equal verdicts, and times of a ratio of 1."""
    result = diff_runs(run_folders / "a", run_folders / "a")
    assert not result.changed and not result.settings
    assert [*result.detectors] == ["slow", "hybrid"]
    assert all(detector.same_verdicts and detector.time_ratio == 1.0 for detector in result.detectors.values())


def test_runs_of_different_recordings_are_refused_unless_that_is_meant(run_folders, capsys):
    """Runs a and c replay two motions: the command says which option compares them all the same."""
    folders = [str(run_folders / "a"), str(run_folders / "c")]
    assert main(["diff", *folders]) == 1
    error = " ".join(capsys.readouterr().err.split())
    assert "replay different recordings" in error and "add --different-sessions" in error
    assert main(["diff", *folders, "--different-sessions"]) == 0
    assert "?" not in capsys.readouterr().out, "without a reference there is no fraction of false contact to print"


def test_runs_of_a_single_recording_are_compared(run_folders):
    """Runs b and c replay the second motion; their detectors ``slow``, of 50 and of 100 Hz, share no contact.

    Detectors of b had all frames at once: no frame was timed alone, so the slowest frames (p99) have no ratio.
    """
    detector = diff_runs(run_folders / "b", run_folders / "c").detectors["slow"]
    assert detector.same == 0 and detector.changed
    assert detector.p99_ratio is None


def test_another_interval_of_a_recording_is_a_setting_that_differs(run_folders, tmp_path):
    """Run a replays fourteen frames of 10 ms; another run from 20 ms on has 12 of them."""
    later = {"oracle": "none", "picture": False, "start": 0.02, "policy": ["frozen=drop"]}
    run(cubes(CUBE_B_BEFORE), detectors="slow=discrete[rate_hz=100]", out=tmp_path / "later", **later)
    assert diff_runs(run_folders / "a", tmp_path / "later").settings["session.frames"] == (14, 12)


@pytest.fixture(scope="module")
def before_and_after(tmp_path_factory):
    """Run folders of two cubes of 1 m that meet in four of fourteen frames, at 0.8 and 0.9 m apart.

    In run coarse boxes with a skin of 0.3 m also meet at 1.2 m, which is one frame of the five that they report: 20 %
    false contact. In run fine boxes have no skin. They bear another label in each run, as colliders do whose setting
    is part of their name. In run other there are spheres, and run short ends at 0.1 s; exact is the reference of all.
    """
    at = tmp_path_factory.mktemp("colliders")
    session = cubes([3, 0.9, 3, 1.2, 3, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 3])
    more = {"oracle": "exact", "picture": False}
    run(session, detectors="wide50=collider[shape=box,skin_m=0.3],exact", out=at / "coarse", **more)
    run(session, detectors="collider-shipped-50=collider[shape=box],exact", out=at / "fine", **more)
    run(session, detectors="mine=sphere,exact", out=at / "other", **more)
    run(session, detectors="wide50=collider[shape=box],exact", out=at / "short", end=0.1, **more)
    return at


def test_colliders_under_other_labels_are_compared(before_and_after):
    """Two cubes by boxes with a skin of 0.3 m, 20 % of whose contact is false (run coarse), and without (run fine)."""
    result = diff_runs(before_and_after / "coarse", before_and_after / "fine")
    assert list(result.detectors) == ["wide50 -> collider-shipped-50", "exact"]
    assert result.changed and not result.only_a and not result.only_b
    assert result.answer.startswith("Yes: wide50 -> collider-shipped-50: false contact 20 % -> 0 %, ")
    reverse = diff_runs(before_and_after / "fine", before_and_after / "coarse")
    assert reverse.answer.startswith("No, worse: collider-shipped-50 -> wide50: false contact 0 % -> 20 %, ")


def test_diff_counts_late_contacts_as_the_ranking_does(before_and_after):
    """Two cubes by boxes with a skin (run coarse) and without (run fine): ``late`` and loss are those of the rankings.

    ``late``: contacts that begin late or are cut short, the fewest and the most over sampling offsets. The skin, with
    its false contact, has the larger loss; exact, the reference of both runs, has none.
    """
    folders = [before_and_after / "coarse", before_and_after / "fine"]
    wide, shipped = (
        next(rank for rank in read_run_folder(folder).ranking if rank.label == label)
        for folder, label in zip(folders, ("wide50", "collider-shipped-50"), strict=True)
    )
    detectors = diff_runs(*folders).detectors
    colliders = detectors["wide50 -> collider-shipped-50"]
    assert colliders.late == (wide.late_counts, shipped.late_counts)
    assert colliders.loss == (wide.loss, shipped.loss) and wide.loss > shipped.loss
    assert detectors["exact"].loss == (None, None)


def test_body_of_a_single_run_is_a_setting_that_differs(before_and_after, tmp_path):
    """The summary of a copy of run coarse has a body c, the same as b, beside a and b: the run itself has none."""
    copy = shutil.copytree(before_and_after / "coarse", tmp_path / "copy")
    bodies = json.loads((copy / "summary.json").read_text())["session"]["bodies"]
    tamper(copy, "session", bodies=bodies | {"c": bodies["b"]})
    settings = diff_runs(before_and_after / "coarse", copy).settings
    assert settings == {"session.bodies.c": (None, bodies["b"])}


def test_diff_compares_the_last_detectors_under_different_names(before_and_after):
    """Beside the reference each run has one detector, wide50, a box, and mine, a sphere."""
    result = diff_runs(before_and_after / "coarse", before_and_after / "other")
    assert list(result.detectors) == ["wide50 -> mine", "exact"]


def test_run_of_another_interval_is_never_better(before_and_after):
    """Run coarse has 14 frames of 10 ms, run short ends at 0.1 s: they have other contacts to miss."""
    answer = diff_runs(before_and_after / "coarse", before_and_after / "short").answer
    assert "cannot be told: the runs differ in session.frames and window" in answer


def test_first_line_on_the_screen_is_the_answer(before_and_after, capsys):
    """Only one label of each run is not in the other, so these two are compared: 20 % false contact, and none."""
    assert main(["diff", str(before_and_after / "coarse"), str(before_and_after / "fine")]) == 0
    output = capsys.readouterr().out
    assert output.startswith("Yes: wide50 -> collider-shipped-50")
    assert "20 -> 0 %" in output


def test_option_compare_names_a_pair_of_detectors(before_and_after, capsys):
    """wide50 of the first run with exact of the second; a label that the second run has not is refused."""
    command = ["diff", str(before_and_after / "coarse"), str(before_and_after / "fine"), "--compare"]
    assert main([*command, "wide50=exact"]) == 0
    assert "wide50 -> exact" in capsys.readouterr().out
    assert main([*command, "wide50=nothing"]) == 1
    error = " ".join(capsys.readouterr().err.split())
    assert "no detector 'nothing'; there are: collider-shipped-50, exact" in error


@pytest.mark.parametrize(
    ("rows_too_few", "texts"), [(0, []), (1, ["… and 1 more with --format json"])], ids=["all rows fit", "one too few"]
)
def test_screen_lists_the_first_changes_and_counts_the_rest(before_and_after, capsys, monkeypatch, rows_too_few, texts):
    """Two runs, whose boxes have a skin or none, differ in some contacts, a row each.

    So many rows are allowed as the detector with most changes has, or one fewer.
    """
    folders = [before_and_after / "coarse", before_and_after / "fine"]
    changes = {label: [*change_lines(detector)] for label, detector in diff_runs(*folders).detectors.items()}
    label = max(changes, key=lambda label: len(changes[label]))
    assert changes[label]
    monkeypatch.setattr("replay.cli.diff.MOST_ROWS", len(changes[label]) - rows_too_few)
    assert main(["diff", *map(str, folders)]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines() if " more with" in line]
    assert lines == [f"{label}: {text}" for text in texts]
