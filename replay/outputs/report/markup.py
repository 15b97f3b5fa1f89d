"""Pieces of HTML in which every word from outside is escaped: a body may be called ``<script>``."""

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Final

from replay.base.shown import shown
from replay.outputs.tables import CODE, STRONG, Cell, Marked, Table

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
    """One element; ``class_`` stands for ``class``."""
    named = {key.rstrip("_").replace("_", "-"): escape(shown(str(value))) for key, value in attributes.items()}
    words = "".join(f' {key}="{value}"' for key, value in named.items())
    return Markup(f"<{name}{words}>{''.join(safe(one) for one in content)}</{name}>")


def joined(parts: Iterable[object]) -> Markup:
    """Pieces one after the other."""
    return Markup("\n".join(safe(part) for part in parts))


def page_html(title: str, top: Iterable[object], sections: Iterable[object], caveat: str = "", style: str = "") -> str:
    """A self-contained page: ``top`` is its header, ``caveat`` its footer, ``style`` goes before the common one."""
    page, common = (files("replay.outputs.report").joinpath(name).read_text(encoding="utf-8") for name in FILES)
    return Template(page).substitute(
        allowed=ALLOWED, title=safe(title), style=style + common, top=joined(top), sections=joined(sections),
        footer=element("footer", element("p", caveat)) if caveat else "",
    )  # fmt: skip


Part = Table | str
"""What a section holds: a table, a piece of HTML, or a paragraph of plain text."""


def page_section(title: str, *parts: Part, fold: bool = False) -> Markup:
    """A part of a page below its heading; ``fold``: only the heading is seen until it is opened."""
    name, heading = re.sub(r"\W+", "-", title.lower()), element("h2", title)
    content = [rendered(part) for part in parts]
    inside = element("details", element("summary", heading), *content) if fold else joined([heading, *content])
    return element("section", inside, id=name)


def rendered(part: Part) -> Markup:
    """A part of a section as HTML."""
    if isinstance(part, Table):
        return page_table(part)
    return part if isinstance(part, Markup) else element("p", part)


def listed(lines: Iterable[object]) -> Markup:
    """A list of these lines."""
    return element("ul", *(element("li", line) for line in lines))


def contents(sections: Iterable[Markup]) -> Markup:
    """Links to the parts of a page."""
    found = re.findall('<section id="([^"]*)">.*?<h2>(.*?)</h2>', "".join(sections))
    links = (element("a", Markup(title), href=f"#{name}") for name, title in found)
    return element("nav", listed(links), aria_label="Contents")


def page_table(made: Table, cards: Sequence[Mapping[str, object]] = ()) -> Markup:
    """A table as HTML, its notes below it; with ``cards``, the attributes of each row, every row looks like a card."""

    # What looks like a card is no table to a browser any more: the roles say what it is.
    def part(name: str, role: str, *content: object, **more: object) -> Markup:
        return element(name, *content, **({"role": role} if cards else {}), **more)

    columns = [(column.name, "word" if column.words else "number") for column in made.columns]
    head = (part("th", "columnheader", name, scope="col", class_=kind) for name, kind in columns)
    rows = (
        part("tr", "row", *(
            part("td", "cell", _cell(cell), class_=kind, **(_said(name, cell) if cards else {}))
            for (name, kind), cell in zip(columns, row, strict=True)
        ), **about)
        for row, about in zip(made.rows, cards or [{}] * len(made.rows), strict=True)
    )  # fmt: skip
    inside = (part("thead", "rowgroup", part("tr", "row", *head)), part("tbody", "rowgroup", *rows))
    whole = part("table", "table", element("caption", made.title), *inside, class_="cards" if cards else "rows")
    if not cards:
        whole = element("div", whole, class_="wide", tabindex="0", role="region", aria_label=made.title)
    return joined([whole, *(element("p", note) for note in made.notes)])


UNITS: Final = {"at s": ("at", "s"), "cut mm": ("cut", "mm"), "mm apart": ("", "mm apart")}
"""Heading of a column -> what a card says before the number, and behind it."""


def _said(name: str, cell: Cell) -> dict[str, str]:
    """What a card says around a cell; a remark below a number would come before its unit."""
    before, behind = UNITS.get(name, (name, "")) if not (isinstance(cell, Marked) and cell.below) else (name, "")
    return {"data_name": before} | ({"data_unit": behind} if behind else {})


MARKS: Final = {STRONG: "b", CODE: "code"}
"""Mark -> element."""


def _cell(cell: Cell) -> Markup:
    """A cell as HTML; numbers are left without separators, so that programs can read them."""
    if not isinstance(cell, Marked):
        return safe("" if cell is None else cell)
    text = element(MARKS[cell.mark], cell.text) if cell.mark in MARKS else safe(cell.text)
    if cell.mark == CODE:
        # A command is broken at blanks, not at the hyphens of its options.
        text = Markup(re.sub(r"(?<=[ >])[^ <>]*-[^ <>]*", r"<span>\g<0></span>", text))
    text = element("a", text, href=cell.to) if cell.to else text
    return joined([text, element("small", cell.below)]) if cell.below else text


def picture(png: bytes, words: str) -> Markup:
    """A picture that lies in the page itself, with what it shows in words."""
    source = "data:image/png;base64," + b64encode(png).decode()
    return element("figure", Markup(f'<img src="{source}" alt="{safe(words)}">'), element("figcaption", words))
