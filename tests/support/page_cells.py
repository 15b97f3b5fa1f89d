"""The tables and the numbers of an HTML page, for tests that hold them against others."""

import re
from html import unescape
from html.parser import HTMLParser


class Cells(HTMLParser):
    """The tables of a page: caption -> rows of cell texts."""

    def __init__(self, page):
        super().__init__()
        self.tables, self.row, self.caption, self.text = {}, [], "", ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        if tag in ("td", "caption"):
            self.text = ""
        if tag == "tr":
            self.row = []

    def handle_data(self, data):
        self.text += data

    def handle_endtag(self, tag):
        if tag == "caption":
            self.caption = self.text
            self.tables[self.caption] = []
        elif tag == "td":
            self.row.append(self.text)
        elif tag == "tr" and self.row:
            self.tables.setdefault(self.caption, []).append(self.row)


NUMBER = re.compile(r"(?<![\w.,])(?<!\w-)[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
SCALES = (1, 100, 1e3, 9e3)
"""As it is, in percent, in thousandths, in percent of a frame at 90 Hz."""


def values_of(value):
    """Every number below a value, also in words and as a length; of a share the ends of its interval in contacts."""
    if isinstance(value, dict):
        if "low" in value and value.get("of"):
            yield from (value[end] * value["of"] for end in ("low", "high"))
        if "processor_share" in value:
            yield 1.0 - value["processor_share"]
        yield from (number for pair in value.items() for one in pair for number in values_of(one))
    elif isinstance(value, list):
        yield from (len(value), *(number for one in value for number in values_of(one)))
    elif isinstance(value, str):
        yield from (float(one.replace(",", "")) for one in NUMBER.findall(value))
    elif value is not None:
        yield float(value)


def shown_as(told, numbers):
    """Whether one of the numbers, rounded as a page rounds, is what is told."""
    told = told.replace(",", "").lstrip("+-")
    digits = len(told.partition(".")[2])
    ways = (f"{abs(one) * scale:{way}}" for one in numbers for scale in SCALES for way in (f".{digits}f", ".2g", ".3g"))
    return told in ways


def said_in(page):
    """What a reader sees of a page without its plots."""
    return unescape(re.sub("<[^>]*>", " ", re.sub(r"<(style|svg|title)\b.*?</\1>", " ", page, flags=re.DOTALL)))
