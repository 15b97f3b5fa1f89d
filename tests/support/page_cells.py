"""The tables of an HTML page, for tests that hold its numbers against others."""

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
            self.tables[self.caption].append(self.row)
