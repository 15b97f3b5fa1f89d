"""The script of a page: small files joined in order, and the digest by which a browser is allowed to run it."""

import hashlib
from base64 import b64encode
from dataclasses import dataclass
from functools import cache
from typing import Final

from markupsafe import Markup

from replay.show.report.markup import file_text

TABLES_SCRIPTS: Final = ("tools", "tables")
"""Files for a page that holds tables only."""

REPORT_SCRIPTS: Final = (*TABLES_SCRIPTS, "lanes", "faults")
"""Files for the page of a run."""


@dataclass(frozen=True)
class PageScript:
    """A script as it stands in a page; ``digest`` is its part of the page's Content-Security-Policy."""

    text: Markup
    digest: Markup


@cache
def page_script(files: tuple[str, ...]) -> PageScript:
    """Return the joined files, without comments and indentation."""
    lines = [
        line.strip()
        for name in files
        for line in file_text(f"show/report/script/{name}.js").splitlines()
        if line.strip() and not line.strip().startswith("//")
    ]
    text = '"use strict";{\n' + "\n".join(lines) + "\n}"
    digest = b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return PageScript(Markup(text), Markup(f"'sha256-{digest}'"))
