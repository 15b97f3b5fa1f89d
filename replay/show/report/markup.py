"""Pages are templates beside their modules, filled in so that every word from outside is text: a body may be called
``<script>``."""

import re
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from replay import words
from replay.document.placeholders import in_run_folder
from replay.show.palette import page_colours
from replay.show.report.charts import path_of
from replay.words import plural, safe_text

if TYPE_CHECKING:
    from jinja2 import Environment

CONTENT_POLICY: Final = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
)
"""What a browser may load for a page: its own styles and pictures; no font, no other address, no foreign script."""

FIGURE_IN_TEXT: Final = re.compile(r"(?<![\w.])(\d[\d,.]*(?:-\d+)?(?: %| of \d+ contacts?))")
"""The figure that a sentence is about."""


def render_template(template: str, **template_values: object) -> str:
    """A template of this package, ``show/report/run.html``, with these values."""
    return environment().get_template(template).render(template_values)


def file_text(file_name: str) -> str:
    """A file of this package."""
    return files("replay").joinpath(file_name).read_text(encoding="utf-8")


@cache
def environment() -> "Environment":
    """How templates are read: values are escaped but in Markdown, and a value that is not there is an error."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    from replay.show.report.template_cache import TemplateCache

    new_environment = Environment(
        loader=FunctionLoader(file_text),
        bytecode_cache=TemplateCache(),
        optimized=False,  # the cache keeps no result of a filter
        undefined=StrictUndefined,
        finalize=_readable,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=lambda name: not (name or "").endswith(".md"),
    )
    new_environment.globals |= {"allowed": Markup(CONTENT_POLICY), "colours": Markup(page_colours())}
    new_environment.filters |= {
        "address": address_of,
        "figure": parts_of,
        "here": in_run_folder,
        "path": path_of,
        "plural": plural,
        "moment": words.moment,
    }
    return new_environment


def _readable(value: object) -> object:
    if hasattr(value, "__html__"):
        return value
    return "" if value is None else safe_text(str(value), lines=True)


def parts_of(sentence: str) -> tuple[str, str, str]:
    """Splits a sentence at its first figure: text before, figure, text after."""
    text_before, first_figure, text_after = [*FIGURE_IN_TEXT.split(sentence, 1), "", ""][:3]
    return text_before, first_figure, text_after


def moment_address(kind: str, number: int, by: str = "") -> str:
    """Address on the page of a moment of this ``kind``, ``miss`` or ``false``: ``#miss-4``, ``#false-2-hull50``."""
    return f"{kind}-{number}" + (f"-{by}" if by else "")


def address_of(text: str) -> str:
    """Words as the part of an address."""
    return re.sub(r"\W+", "-", text.lower()).strip("-")
