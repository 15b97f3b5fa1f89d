import pytest

from replay.cli.main import main


@pytest.mark.slow
def test_a_small_class_goes_the_whole_way_to_its_page(tmp_path, capsys):
    assert main(["demo", "--class", "5", "--out", str(tmp_path / "class")]) == 0
    printed, said = capsys.readouterr()
    assert "5 students, 5 sessions" in printed and "Does the detector change a conclusion? Not known" in printed
    assert "few-students" in (tmp_path / "class" / "study" / "study.html").read_text("utf-8")
    assert "5 of 5  S05: done" in said


def test_a_class_is_no_single_session(tmp_path, capsys):
    assert main(["demo", "--class", "5", "--session-only", "-o", str(tmp_path / "class")]) == 2
    assert "leave out --session-only" in capsys.readouterr().err and not (tmp_path / "class").exists()
