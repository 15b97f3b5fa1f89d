"""Pieces of HTML in which every word from outside is escaped: a body may be called ``<script>``."""

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any, Final

from replay.base.shown import shown
from replay.outputs import tables
from replay.outputs.tables import CODE, STRONG, Cell, Marked, Table

ALLOWED: Final = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""What a browser may load for a page: its own styles and pictures; no script, no font, no other address."""


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
    common = files("replay.outputs.report").joinpath("style.css").read_text(encoding="utf-8")
    head = [
        Markup(f'<meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{ALLOWED}">'),
        Markup('<meta name="viewport" content="width=device-width, initial-scale=1">'),
        element("title", title),
        Markup(f"<style>{style}{common}</style>"),
    ]
    body = [element("header", *top), element("main", joined(sections))]
    body += [element("footer", element("p", caveat))] if caveat else []
    return f'<!doctype html>\n<html lang="en"><head>{joined(head)}</head><body>{joined(body)}</body></html>\n'


def page_section(title: str, *content: object, fold: bool = False) -> Markup:
    """A part of a page below its heading; ``fold``: only the heading is seen until it is opened."""
    name, heading = re.sub(r"\W+", "-", title.lower()), element("h2", title)
    inside = element("details", element("summary", heading), *content) if fold else joined([heading, *content])
    return element("section", inside, id=name)


def contents(sections: Iterable[Markup]) -> Markup:
    """Links to the parts of a page."""
    found = re.findall('<section id="([^"]*)">.*?<h2>(.*?)</h2>', "".join(sections))
    links = (element("li", element("a", Markup(title), href=f"#{name}")) for name, title in found)
    return element("nav", element("ul", *links), aria_label="Contents")


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[Any]], *, words: int = 1) -> Markup:
    """A table whose first ``words`` columns hold words and whose others hold numbers."""
    return page_table(tables.table(caption, head, rows, words=words))


def page_table(made: Table, cards: Sequence[Mapping[str, object]] = ()) -> Markup:
    """A table as HTML, its notes below it; with ``cards``, the attributes of each row, every row looks like a card."""
    if cards:
        return _card_table(made, cards)
    kinds = ["word" if column.words else "number" for column in made.columns]
    names = zip(made.columns, kinds, strict=True)
    header = element("tr", *(element("th", column.name, scope="col", class_=kind) for column, kind in names))
    body = [
        element("tr", *(element("td", _cell(cell), class_=kind) for kind, cell in zip(kinds, row, strict=True)))
        for row in made.rows
    ]
    whole = element("table", element("caption", made.title), element("thead", header), element("tbody", *body))
    shown = element("div", whole, class_="wide", tabindex="0", role="region", aria_label=made.title)
    return joined([shown, *(element("p", note) for note in made.notes)])


def _card_table(made: Table, cards: Sequence[Mapping[str, object]]) -> Markup:
    # What looks like a card is no table to a browser any more: the roles say what it is.
    kinds: list[dict[str, object]] = [{} if column.words else {"class_": "number"} for column in made.columns]
    names = (column.name for column in made.columns)
    header = element("tr", *(element("th", name, scope="col", role="columnheader") for name in names), role="row")
    rows = [
        element(
            "tr",
            *(
                element("td", _cell(cell), role="cell", data_name=column.name, **kind)
                for column, kind, cell in zip(made.columns, kinds, row, strict=True)
            ),
            role="row", **about,
        )
        for row, about in zip(made.rows, cards, strict=True)
    ]  # fmt: skip
    parts = [element("caption", made.title), element("thead", header, role="rowgroup")]
    whole = element("table", *parts, element("tbody", *rows, role="rowgroup"), class_="cards", role="table")
    return joined([whole, *(element("p", note) for note in made.notes)])


MARKS: Final = {STRONG: "b", CODE: "code"}
"""Mark -> element."""


def _cell(cell: Cell) -> Markup:
    """A cell as HTML; numbers are left without separators, so that programs can read them."""
    if not isinstance(cell, Marked):
        return safe("" if cell is None else cell)
    text = element(MARKS[cell.mark], cell.text) if cell.mark in MARKS else safe(cell.text)
    text = element("a", text, href=cell.to) if cell.to else text
    return joined([text, element("small", cell.below)]) if cell.below else text


def bar(title: str, x: float, y: float, width: float, height: float, **more: object) -> Markup:
    """A rectangle of an SVG that says what it is when pointed at."""
    at = {"x": f"{x:.1f}", "y": f"{y:g}", "width": f"{width:.1f}", "height": f"{height:g}"}
    return element("rect", element("title", title), **at, **more)


def picture(png: bytes, words: str) -> Markup:
    """A picture that lies in the page itself, with what it shows in words."""
    source = "data:image/png;base64," + b64encode(png).decode()
    return element("figure", Markup(f'<img src="{source}" alt="{safe(words)}">'), element("figcaption", words))
