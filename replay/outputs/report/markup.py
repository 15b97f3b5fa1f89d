"""Pieces of HTML in which every word from outside is escaped: a body may be called ``<script>``."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from string import Template
from typing import Final

from replay.base.shown import shown
from replay.base.tables import STRONG, Cell, Marked, Table

ALLOWED: Final = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""What a browser may load for a page: its own styles and pictures; no script, no font, no other address."""

FILES: Final = ("page.template.html", "style.css")


class Markup(str):
    """Text that is HTML already; all other text is escaped when it is put into a page."""

    __slots__ = ()


def safe(value: object) -> Markup:
    """A value as HTML."""
    return value if isinstance(value, Markup) else Markup(escape(shown(str(value), lines=True)))


def element(name: str, *content: object, **attributes: object) -> Markup:
    """One element; ``class_`` stands for ``class``; an attribute of no letters is left out."""
    named = ((key.rstrip("_").replace("_", "-"), escape(shown(str(value)))) for key, value in attributes.items())
    words = "".join(f' {key}="{value}"' for key, value in named if value)
    return Markup(f"<{name}{words}>{''.join(safe(one) for one in content)}</{name}>")


def joined(parts: Iterable[object]) -> Markup:
    """Pieces one after the other."""
    return Markup("\n".join(safe(part) for part in parts))


def page_html(title: str, top: Iterable[object], sections: Iterable[object], caveat: str = "", style: str = "") -> str:
    """A self-contained page: ``caveat`` stands below, ``style`` comes after the common one."""
    page, common = (files("replay.outputs.report").joinpath(name).read_text(encoding="utf-8") for name in FILES)
    return Template(page).substitute(
        allowed=ALLOWED, title=safe(title), style=common + style, top=joined(top), sections=joined(sections),
        footer=element("footer", element("p", caveat)) if caveat else "",
    )  # fmt: skip


Part = Table | str
"""What a section holds: a table, a piece of HTML, or a paragraph of plain text."""


@dataclass(frozen=True)
class Fold:
    """Parts below a line that opens them."""

    words: str
    parts: Sequence[Part]


@dataclass(frozen=True)
class Section:
    """A part of a page; ``short`` is its name in the list of contents."""

    title: str
    short: str
    parts: Sequence[Part | Fold]

    @property
    def address(self) -> str:
        """Where a link finds it."""
        return address_of(self.short)


def moment_address(kind: str, number: int, by: str = "") -> str:
    """Where a page has a moment of this ``kind``, ``miss`` or ``false``: ``#miss=4``, ``#false=2&by=hull50``."""
    return f"{kind}={number}" + (f"&by={by}" if by else "")


def address_of(words: str) -> str:
    """Words as the part of an address."""
    return re.sub(r"\W+", "-", words.lower()).strip("-")


def section_html(section: Section) -> Markup:
    """A section below its heading."""
    heading = element("h2", section.title, class_="big")
    return element("section", heading, *(rendered(part) for part in section.parts), id=section.address)


def contents(sections: Iterable[Section]) -> Markup:
    """Links to the sections."""
    links = (element("a", section.short, href=f"#{section.address}") for section in sections)
    return element("nav", *links, aria_label="Contents")


def rendered(part: Part | Fold) -> Markup:
    """A part of a section as HTML."""
    if isinstance(part, Fold):
        inside = (rendered(own) for own in part.parts)
        return element("details", element("summary", part.words), *inside, class_="fold", id=address_of(part.words))
    if isinstance(part, Table):
        return page_table(part)
    return part if isinstance(part, Markup) else element("p", part)


def listed(lines: Iterable[object]) -> Markup:
    """A list of these lines."""
    return element("ul", *(element("li", line) for line in lines))


def page_table(made: Table) -> Markup:
    """A table as HTML, its notes below it; a keyboard can move a wide one."""
    kinds = ["word" if column.words else "number" for column in made.columns]
    head = (element("th", name, scope="col", class_=kind) for name, kind in zip(made.head, kinds, strict=True))
    rows = (
        element("tr", *(element("td", _cell(cell), class_=kind) for cell, kind in zip(row, kinds, strict=True)))
        for row in made.cells()
    )
    inside = element("thead", element("tr", *head)), element("tbody", *rows)
    whole = element("table", element("caption", made.title), *inside, class_="rows")
    box = element("div", whole, class_="wide", tabindex="0", role="region", aria_label=made.title)
    return joined([box, *(element("p", note, class_="note") for note in made.notes)])


MARKS: Final = {STRONG: "b"}
"""Mark -> element."""


def _cell(cell: Cell) -> Markup:
    """A cell as HTML; numbers are left without separators, so that programs can read them."""
    if not isinstance(cell, Marked):
        return safe("" if cell is None else cell)
    text = element(MARKS[cell.mark], cell.text) if cell.mark in MARKS else safe(cell.text)
    text = element("a", text, href=cell.to) if cell.to else text
    return joined([text, element("small", cell.below)]) if cell.below else text
