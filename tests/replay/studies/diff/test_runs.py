import json
from dataclasses import replace

import pytest
from support.small_worlds import unit_cubes_on_x

from replay import run
from replay.cli.main import main
from replay.show.results.run_folder import read_run_folder
from replay.studies.diff.answer import answer_of
from replay.studies.diff.diff_words import change_lines
from replay.studies.diff.runs import diff_runs

BEFORE = {"a": [0] * 14, "b": [3, 0.9, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 3]}
AFTER = {"a": [0] * 14, "b": [3, 0.9, 3, 3, 3.0, 3, 3, 0.9, 0.9, 0.8, 3.0, 3, 0.9, 3]}
"""Beside the first, the second lost the contact at 4, shifted the one at 8 to 10, and gained one at 12."""


@pytest.fixture(scope="module")
def run_folders(tmp_path_factory):
    """Run folders a, b and c: b and c replay another motion, b with other detectors."""
    at = tmp_path_factory.mktemp("runs")
    more = {"picture": False, "oracle": "none"}
    run(unit_cubes_on_x(BEFORE), detectors="slow=discrete[rate_hz=100],hybrid", out=at / "a", **more)
    run(unit_cubes_on_x(AFTER), detectors="slow=discrete[rate_hz=50],sphere,aabb", out=at / "b", seed=3, **more)
    run(unit_cubes_on_x(AFTER), detectors="slow=discrete[rate_hz=100]", out=at / "c", **more)
    return at


def summary_of(folder):
    """The summary of a run folder."""
    return json.loads((folder / "summary.json").read_text())


def test_diff_finds_planted_gained_lost_and_shifted_contacts(run_folders):
    """Frames of 10 ms: the contact in frame 4 is lost, one in 12 gained, that of 8 to 10 a frame earlier.

    Any of the three kinds of change counts as a change; times are ratios of both summaries.
    """
    result = diff_runs(run_folders / "a", run_folders / "c", different_sessions=True).detectors["slow"]
    assert result.same == 1
    assert [contact.start for contact in result.lost] == [pytest.approx(0.04)]
    assert [contact.start for contact in result.gained] == [pytest.approx(0.12)]
    (shift,) = result.shifted
    assert (shift.start, shift.end) == (pytest.approx(-0.01), pytest.approx(-0.01))
    assert result.same_verdicts is False
    before, after = (summary_of(run_folders / name)["detectors"]["slow"]["seconds"] for name in "ac")
    assert result.time_ratio == pytest.approx(after["detect"] / before["detect"])
    assert result.p99_ratio == pytest.approx(after["sample_times"]["p99"] / before["sample_times"]["p99"])
    kinds = {"gained", "lost", "shifted"}
    assert all(replace(result, **dict.fromkeys(kinds - {kind}, ())).changed for kind in kinds)


def test_diff_lists_exactly_the_settings_that_differ(run_folders):
    """Run b has another seed, its ``slow`` 50 Hz in place of 100, and two detectors that a has not."""
    result = diff_runs(run_folders / "a", run_folders / "b", different_sessions=True)
    assert result.settings == {"seed": (0, 3), "slow.settings.rate_hz": (100, 50)}
    assert (result.only_a, result.only_b) == (("hybrid",), ("sphere", "aabb"))


def test_diff_of_a_run_with_itself_is_empty(run_folders):
    """Equal verdicts, and times of a ratio of 1."""
    result = diff_runs(run_folders / "a", run_folders / "a")
    assert not result.changed and not result.settings
    assert all(item.same_verdicts and item.time_ratio == 1.0 for item in result.detectors.values())


def test_runs_of_different_recordings_are_refused_unless_that_is_meant(run_folders, tmp_path, capsys):
    """Runs a and c replay two motions; b and c the same one, and are compared.

    A window from 20 ms leaves 12 of 14 frames: that is a setting that differs.
    """
    assert main(["diff", str(run_folders / "a"), str(run_folders / "c")]) == 1
    output = capsys.readouterr().err
    assert "replay different recordings" in output and "add --different-sessions" in output
    main(["diff", str(run_folders / "a"), str(run_folders / "c"), "--different-sessions"])
    assert "?" not in capsys.readouterr().out, "without a reference there is no fraction of false contact to print"
    assert not diff_runs(run_folders / "b", run_folders / "c").detectors["slow"].same, "of one recording they compare"
    again = {"oracle": "none", "picture": False, "start": 0.02, "policy": ["frozen=drop"]}
    run(unit_cubes_on_x(BEFORE), detectors="slow=discrete[rate_hz=100]", out=tmp_path / "moved", **again)
    assert diff_runs(run_folders / "a", tmp_path / "moved").settings["session.frames"][1] == 12


@pytest.fixture(scope="module")
def before_and_after(tmp_path_factory):
    """Folder of runs of two cubes of 1 m that meet in four of fourteen frames, at 0.8 and 0.9 m.

    Boxes with a skin of 0.3 m also meet at 1.2 m, which is one frame of the five that they report, 20 % false contact.
    The boxes bear another label in each run, as colliders do whose setting is part of their name.
    """
    at = tmp_path_factory.mktemp("colliders")
    session = unit_cubes_on_x({"a": [0] * 14, "b": [3, 0.9, 3, 1.2, 3, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 3]})
    for name, detectors in (
        ("coarse", "wide50=collider[shape=box,skin_m=0.3],exact"),
        ("fine", "collider-shipped-50=collider[shape=box],exact"),
        ("other", "mine=sphere,exact"),
        ("short", "wide50=collider[shape=box],exact"),
    ):
        end = {"end": 0.1} if name == "short" else {}
        run(session, detectors=detectors, oracle="exact", out=at / name, picture=False, **end)
    return at


def test_colliders_under_other_labels_are_compared(before_and_after):
    """The runs coarse and fine: 20 % false contact with a skin of 0.3 m, none without."""
    result = diff_runs(before_and_after / "coarse", before_and_after / "fine")
    assert list(result.detectors) == ["wide50 -> collider-shipped-50", "exact"]
    assert result.changed and not result.only_a and not result.only_b
    assert result.answer.startswith("Yes: wide50 -> collider-shipped-50: false contact 20 % -> 0 %, ")
    back = diff_runs(before_and_after / "fine", before_and_after / "coarse")
    assert back.answer.startswith("No, worse: collider-shipped-50 -> wide50: false contact 0 % -> 20 %, ")


SAME_COUNTS = {"false_contact": (0.2, 0.2), "missed": ((1, 3), (1, 3)), "late": ((1, 3), (1, 3))}
BETTER = {**SAME_COUNTS, "loss": (0.5, 0.1), "mean_seconds": (0.001, 0.001)}
WORSE = {**BETTER, "loss": (0.1, 0.5)}
RISE, FALL = ((1, 3), (1, 4)), ((1, 3), (1, 2))


@pytest.mark.parametrize(
    ("planted", "beginning", "text"),
    [
        (BETTER, "Yes: ", "1-3 of 2 contacts missed in both, loss "),
        (BETTER | {"late": RISE}, "Yes, on balance: ", "late or cut short 1-3 -> 1-4, loss "),
        (BETTER | {"missed": RISE}, "Yes, on balance: ", "missed 1-3 -> 1-4 of 2 contacts"),
        (BETTER | {"false_contact": (0.1, 0.2)}, "Yes, on balance: ", "false contact 10 % -> 20 %"),
        (BETTER | {"late": FALL, "missed": FALL, "false_contact": (0.2, 0.1)}, "Yes: ", "late or cut short 1-3 -> 1-2"),
        (WORSE, "No, worse: ", "20 % false contact in both"),
        (WORSE | {"late": FALL}, "No, worse, on balance: ", "late or cut short 1-3 -> 1-2"),
        (WORSE | {"missed": FALL}, "No, worse, on balance: ", "missed 1-3 -> 1-2 of 2 contacts"),
        (WORSE | {"false_contact": (0.2, 0.1)}, "No, worse, on balance: ", "false contact 20 % -> 10 %"),
        (WORSE | {"late": RISE, "missed": RISE, "false_contact": (0.1, 0.2)}, "No, worse: ", "loss"),
        (BETTER | {"loss": (0.1, 0.1)}, "No difference: ", "loss 0.1 in both"),
        (BETTER, "Yes: ", "; the same time a frame."),
        (BETTER | {"mean_seconds": (0.001, 0.003)}, "Yes: ", "; 2 ms more a frame."),
        (BETTER | {"mean_seconds": (0.003, 0.001)}, "Yes: ", "; 2 ms less a frame."),
    ],
)
def test_headline_weighs_errors_against_each_other_and_names_cost(before_and_after, planted, beginning, text):
    """``planted``: errors (first run, second run); ``missed``, ``late``: least and most in each."""
    folders = [before_and_after / name for name in ("coarse", "fine")]
    documents = [read_run_folder(folder).document for folder in folders]
    detectors = diff_runs(*folders).detectors
    answer = answer_of(*documents, {name: replace(detector, **planted) for name, detector in detectors.items()}, {})
    assert answer.startswith(beginning) and text in answer


def test_diff_counts_late_contacts_as_the_ranking_does(before_and_after):
    """Expected are the counts of both rankings, least and most over sampling offsets."""
    folders = [before_and_after / name for name in ("coarse", "fine")]
    ranks = [{rank.label: rank for rank in read_run_folder(folder).ranking} for folder in folders]
    detector = diff_runs(*folders).detectors["wide50 -> collider-shipped-50"]
    assert detector.late == tuple(rank[name].late_counts for rank, name in zip(ranks, detector.labels, strict=True))


def test_diff_compares_the_last_detectors_under_different_names(before_and_after):
    """Beside the reference each run has one detector, wide50 and mine."""
    result = diff_runs(before_and_after / "coarse", before_and_after / "other")
    assert list(result.detectors) == ["wide50 -> mine", "exact"]


def test_run_of_another_interval_is_never_better(before_and_after):
    """The run short ends at 0.1 s."""
    answer = diff_runs(before_and_after / "coarse", before_and_after / "short").answer
    assert "cannot be told: the runs differ in session.frames and window" in answer


def test_first_line_on_the_screen_is_the_answer(before_and_after, capsys):
    """Only one label of each run is not in the other, so these two are compared; ``--compare`` names any pair."""
    runs = [str(before_and_after / name) for name in ("coarse", "fine")]
    assert main(["diff", *runs]) == 0
    output = capsys.readouterr().out
    assert output.startswith("Yes: wide50 -> collider-shipped-50") and "20 -> 0 %" in output
    assert main(["diff", *runs, "--compare", "wide50=exact"]) == 0
    assert "wide50 -> exact" in capsys.readouterr().out
    assert main(["diff", *runs, "--compare", "wide50=nothing"]) == 1
    assert "no detector 'nothing'; there are: collider-shipped-50, exact" in capsys.readouterr().err


def test_screen_lists_the_first_changes_and_counts_the_rest(before_and_after, capsys, monkeypatch):
    """So many rows are allowed as the detector with most changes has, or one fewer."""
    runs = [before_and_after / name for name in ("coarse", "fine")]
    changes = {label: [*change_lines(detector)] for label, detector in diff_runs(*runs).detectors.items()}
    label = max(changes, key=lambda label: len(changes[label]))
    for fewer, rest in ((0, ""), (1, f"{label}: … and 1 more with --format json")):
        monkeypatch.setattr("replay.cli.diff.MOST_ROWS", len(changes[label]) - fewer)
        assert main(["diff", *map(str, runs)]) == 0
        lines = [line.strip() for line in capsys.readouterr().out.splitlines() if " more with" in line]
        assert lines == ([rest] if rest else [])
