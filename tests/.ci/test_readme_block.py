"""CI runs the README's own commands: the block it is given is the one that stands there, or it stops and says so."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / ".ci" / "readme_block.py"
README = (ROOT / "README.md").read_text("utf-8")


def asked(language, words, script=SCRIPT):
    return subprocess.run([sys.executable, str(script), language, words], capture_output=True, text=True)


@pytest.mark.parametrize("words", ["pip install", "pytest"])
def test_the_block_is_a_shell_block_of_the_readme_with_those_words(words):
    done = asked("bash", words)
    assert done.returncode == 0 and words in done.stdout
    assert f"```bash\n{done.stdout}```" in README


def test_another_language_gives_another_block():
    assert asked("powershell", "pip install").stdout != asked("bash", "pip install").stdout != ""


def test_words_that_stand_nowhere_stop_ci_with_a_sentence():
    done = asked("bash", "no such words")
    assert done.returncode != 0 and done.stdout == ""
    assert "the README has no bash block with 'no such words'" in done.stderr


def test_the_first_of_several_blocks_is_taken_and_a_block_ends_where_it_ends(tmp_path):
    (tmp_path / ".ci").mkdir()
    copy = tmp_path / ".ci" / "readme_block.py"
    copy.write_text(SCRIPT.read_text("utf-8"), "utf-8")
    (tmp_path / "README.md").write_text(
        "```bash\none x\n```\ntext x\n```bash\ntwo x\n```\n```toml\nx = 1\n```\n", "utf-8"
    )
    assert asked("bash", "x", copy).stdout == "one x\n"
    assert asked("bash", "two", copy).stdout == "two x\n"
    assert asked("toml", "x", copy).stdout == "x = 1\n"
