"""``replay guide``: Markdown where the output is no terminal, rendered where it is one, and a sentence for no page."""

import re
import sys

import pytest

from replay.cli.main import main
from replay.guide.pages import INDEX, page, topics


def test_piped_a_page_is_its_markdown(capsys):
    assert main(["guide", "hard-cases"]) == 0
    assert capsys.readouterr().out == page("hard-cases")
    assert main(["guide"]) == 0
    assert capsys.readouterr().out == page(INDEX)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("topic", topics())
def test_page_fits_80_columns_without_markup(topic, capsys, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["guide", topic]) == 0
    printed = re.sub(r"\x1b\[[\d;]*m", "", capsys.readouterr().out)
    assert max(map(len, printed.splitlines())) <= 80
    assert "](" not in printed and "<!--" not in printed


def test_scripts_are_written_once_and_never_over_another_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["guide", "unity", "--script"]) == 0 == main(["guide", "unity", "--script"])
    recorder = tmp_path / "VrLabRecorder.cs"
    assert "class VrLabRecorder" in recorder.read_text() and (tmp_path / "VrLabColliders.cs").is_file()
    recorder.write_text("mine")
    assert main(["guide", "unity", "--script"]) == 1 and recorder.read_text() == "mine"
    assert main(["guide", "glossary", "--script"]) == 1 and "your-recording" in capsys.readouterr().err
