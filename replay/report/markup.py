"""Pieces of HTML in which every word from outside is escaped: a body may be called ``<script>``."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape


class Markup(str):
    """Text that is HTML already; all other text is escaped when it is put into a page."""

    __slots__ = ()


def safe(value: object) -> Markup:
    """A value as HTML."""
    return value if isinstance(value, Markup) else Markup(escape(str(value)))


def element(name: str, *content: object, **attributes: object) -> Markup:
    """One element; ``class_`` stands for ``class``."""
    words = "".join(f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"' for key, value in attributes.items())
    return Markup(f"<{name}{words}>{''.join(safe(one) for one in content)}</{name}>")


def joined(parts: Iterable[object]) -> Markup:
    """Pieces one after the other."""
    return Markup("\n".join(safe(part) for part in parts))


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[object]], *, words: int = 1) -> Markup:
    """A table whose first ``words`` columns hold words and whose others hold numbers."""
    kinds = ["word" if k < words else "number" for k in range(len(head))]
    header = element("tr", *(element("th", name, scope="col", class_=kinds[k]) for k, name in enumerate(head)))
    body = [
        element("tr", *(element("td", cell, class_=kind) for kind, cell in zip(kinds, row, strict=True)))
        for row in rows
    ]
    return element(
        "div",
        element("table", element("caption", caption), element("thead", header), element("tbody", *body)),
        class_="wide",
        tabindex="0",
        role="region",
        aria_label=caption,
    )


def picture(png: bytes, words: str) -> Markup:
    """A picture that lies in the page itself, with what it shows in words."""
    source = "data:image/png;base64," + b64encode(png).decode()
    return element("figure", Markup(f'<img src="{source}" alt="{escape(words)}">'), element("figcaption", words))
