"""Plots of pages are made but not rendered, except where tests look at them: that takes most of the time of a page."""

import sys

LOOKED_AT = ("tests/replay/studies/class_study/test_page.py",)
"""Tests of what plots show; slow tests look at pages in a browser."""
WHOLE = {}


def pages_of(item):
    """Plots of the pages that a test writes are whole where it is slow or one of ``LOOKED_AT``, else empty."""
    drawing = sys.modules.get("replay.outputs.report.drawing")
    if not drawing:
        return
    WHOLE.setdefault("saved", drawing.saved)
    whole = item.get_closest_marker("slow") or item.nodeid.startswith(LOOKED_AT)
    drawing.saved = WHOLE["saved"] if whole else _made


def _made(_width, _height, draw):
    from matplotlib.figure import Figure

    draw(Figure().add_subplot())
    return "<svg ></svg>"
