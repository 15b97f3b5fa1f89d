"""Pages whose pictures are small and whose plots are made but not rendered: both take most of the time of a run."""

import sys

SMALL = (300, 173)
LOOKED_AT = ("tests/replay/outputs/report/test_charts.py", "tests/replay/studies/class_study/test_page.py")
"""Tests of what pictures and plots show; slow tests look at pages in a browser."""
WHOLE = {}


def pages_of(item):
    """Pages that a test writes are whole where it is slow or one of ``LOOKED_AT``, else small."""
    drawing = sys.modules.get("replay.outputs.report.drawing")
    pictures = sys.modules.get("replay.outputs.report.bench_picture")
    if not (drawing and pictures):
        return
    WHOLE.setdefault("size", (pictures.WIDE, pictures.HIGH))
    WHOLE.setdefault("saved", drawing.saved)
    whole = item.get_closest_marker("slow") or item.nodeid.startswith(LOOKED_AT)
    pictures.WIDE, pictures.HIGH = WHOLE["size"] if whole else SMALL
    drawing.saved = WHOLE["saved"] if whole else _made


def _made(draw, theme, kind, behind=""):
    if kind != "svg" or behind != "none":
        return WHOLE["saved"](draw, theme, kind, behind)
    draw()
    return b"<svg ></svg>"
