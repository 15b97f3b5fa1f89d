"""The guide's table of detectors, written from the detectors themselves: ``python .ci/choosing.py``."""

import re
from typing import Any, Final

from cdcore.detectors.detector_table import DETECTORS, OPTIONAL, load_detector
from replay.guide.pages import PAGES_FOLDER

BEGIN: Final = "<!-- begin of the table that choosing.py makes -->"
END: Final = "<!-- end of the table that choosing.py makes -->"
HEAD: Final = "| name | kind | choose it when | it cannot |\n|---|---|---|---|"


def choosing_table() -> str:
    """Markdown: a row for each detector of the table, in its order, those that need an extra engine last."""
    return "\n".join([HEAD, *(_row(name, load_detector(name)) for name in DETECTORS | OPTIONAL)])


def with_table(text: str, table: str, begin: str = BEGIN, end: str = END) -> str:
    """A text with the table between its two marks; without them a ``ValueError``."""
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    if not pattern.search(text):
        raise ValueError(f"the text has no {begin} and {end}; put both where the table belongs")
    return pattern.sub(lambda _: f"{begin}\n{table}\n{end}", text)


def _row(name: str, detector: type[Any]) -> str:
    cells = (detector.kind, getattr(detector, "choose_when", ""), getattr(detector, "cannot", ""))
    return f"| `{name}` | " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


if __name__ == "__main__":
    glossary = PAGES_FOLDER / "glossary.md"
    glossary.write_text(with_table(glossary.read_text("utf-8"), choosing_table()), encoding="utf-8")
