"""CI runs the README's own commands: the block it is given is the one that stands there, or it stops and says so."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / ".ci" / "readme_block.py"


def asked(language, words):
    return subprocess.run([sys.executable, str(SCRIPT), language, words], capture_output=True, text=True)


@pytest.mark.parametrize(
    ("language", "words"), [("bash", "pip install"), ("bash", "pytest"), ("powershell", "pip install")]
)
def test_the_block_is_one_of_the_readme_in_that_language_with_those_words(language, words):
    block = asked(language, words).stdout
    assert words in block and f"```{language}\n{block}```" in (ROOT / "README.md").read_text("utf-8")


def test_words_that_stand_nowhere_stop_ci_with_a_sentence():
    done = asked("bash", "no such words")
    assert done.returncode != 0 and "the README has no bash block with 'no such words'" in done.stderr
