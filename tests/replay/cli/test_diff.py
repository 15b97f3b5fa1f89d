from support.small_worlds import cubes

from replay import run
from replay.cli.main import main


def test_a_long_list_is_cut_in_the_terminal_and_says_so(tmp_path, capsys):
    places = [3, 0.9] * 40
    run(cubes({"a": [0] * 80, "b": places}), detectors="hybrid", oracle="none", out=tmp_path / "a", picture=False)
    run(cubes({"a": [0] * 80, "b": [3, 2] * 40}), detectors="hybrid", oracle="none", out=tmp_path / "b", picture=False)
    assert main(["diff", str(tmp_path / "a"), str(tmp_path / "b"), "--different-sessions"]) == 0
    printed = capsys.readouterr().out
    assert printed.count("hybrid: lost") == 20 and "and 20 more with --format json" in printed


def test_contacts_gained_and_lost_stand_before_the_largest_shifts_and_a_picture_is_not_asked_for(tmp_path, capsys):
    places = {"a": [0] * 20, "b": [3, 3, 0.9, 0.9, 3, 0.9, 3, 3, 3, 3, 0.9, 0.9, 0.9, 3, 3, 3, 3, 3, 3, 3]}
    for name, rate in (("slow", 25), ("fast", 100)):
        run(cubes(places), detectors=f"it=discrete[rate_hz={rate}]", oracle="exact", out=tmp_path / name, picture=False)
    assert main(["diff", str(tmp_path / "slow"), str(tmp_path / "fast")]) == 0
    printed = capsys.readouterr()
    kinds = [line.split()[1] for line in printed.out.splitlines() if line.startswith("it: ")]
    assert kinds == ["gained", "gained", "shifted"] and "replay view" not in printed.err
