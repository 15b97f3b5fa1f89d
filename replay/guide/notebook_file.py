"""A page of the guide as a notebook: ``python -m replay.guide.notebook_file audit.ipynb``."""

import json
import re
import sys
from pathlib import Path
from typing import Any, Final

from replay.guide.pages import page

PAGE: Final = "notebook"
BLOCK: Final = re.compile(r"```python\n(.*?)```\n?", re.DOTALL)


def notebook(text: str) -> dict[str, Any]:
    """A page as nbformat 4.5: its Python blocks are cells of code, what stands between them is Markdown."""
    cells: list[dict[str, Any]] = []
    for number, part in enumerate(BLOCK.split(text)):
        if part.strip():
            code: dict[str, Any] = {"cell_type": "code", "execution_count": None, "outputs": []}
            kind = code if number % 2 else {"cell_type": "markdown"}
            cells.append({**kind, "id": f"cell-{number}", "metadata": {}, "source": part.strip()})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(notebook(page(PAGE)), indent=1) + "\n", encoding="utf-8")
