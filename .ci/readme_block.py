"""Prints the first code block of the README in a language that contains some words, so that CI runs what it says.

python .ci/readme_block.py bash "pip install"
"""

import re
import sys
from pathlib import Path

language, words = sys.argv[1:]
text = (Path(__file__).resolve().parents[1] / "README.md").read_text("utf-8")
found = re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
block = next((block for block in found if words in block), None)
if block is None:
    sys.exit(f"the README has no {language} block with {words!r}")
print(block, end="")
