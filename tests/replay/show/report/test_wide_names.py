"""Names of detectors in plots, drawn by a browser: none on another one, none cut, whatever letters they have."""

import json
from itertools import combinations

import pytest
from support.viewers import opened

from replay.show.plots import Axis, Dot, scatter, text_width
from replay.show.report.markup import environment

pytestmark = pytest.mark.slow

NAMES = {
    "capitals": ["MWMWMW", "MMMMMMMMMM", "WWWW@@%%", "HULL50", "MESH50", "EXACT"],
    "small": ["mwmwmwmw", "hull50: 0.9", "mesh50: 0.12", "exact: 0", "paper: 0.03", "box: 0.9"],
    "East Asian": [
        "\u691c\u51fa\u5668",
        "\u691c\u51fa\u5668\u306e\u540d\u524d",
        "\u691c\u51fa",
        "a\u691c",
        "\ufeffb",
        "\u691c",
    ],
    "Greek and accents": [
        "\u03a9\u03a9\u03a9\u03a9",
        "\u00c4\u00d6\u00dc",
        "\u00e9t\u00e9",
        "\u03c8",
        "\u0416\u0416\u0416",
        "\u0428",
    ],
}
BOXES = """[...document.querySelectorAll('.lb')].map((label) => {
  const box = label.getBBox();
  return [label.textContent, [box.x, box.y + 2, box.x + box.width, box.y + box.height - 2]];
})"""
"""Text and box (left, top, right, bottom) of each label in the browser; letters leave 2 units above and below."""


@pytest.mark.parametrize("kind", NAMES)
def test_names_drawn_by_a_browser_do_not_collide(kind, tmp_path):
    """Six dots close to each other in a plot of 432 units, a pixel each, named in wide, small or foreign letters.

    Chromium draws no label wider than the product reckons (2 units at most), none cut off, and none on another.
    """
    dots = [Dot(name, x=0.05 + 0.01 * (number % 3), y=0.3 * number) for number, name in enumerate(NAMES[kind])]
    plot = scatter(dots, alternative_text="", x_title="ms", y_axis=Axis("loss", [0, 1, 2]))
    page = environment().from_string(
        '{% import "show/report/parts.html" as parts %}<!doctype html><meta charset="utf-8"><style>{{ colours }}'
        '{% include "show/report/style.css" %}</style><div style="width:432px">{{ parts.plot(plot) }}</div>'
    )
    file = tmp_path / "plot.html"
    file.write_text(page.render(plot=plot), encoding="utf-8")
    with opened(file.as_uri(), tmp_path, (500, 300)) as browser:
        labels = browser.ask(BOXES)
    assert {name for name, _box in labels} & set(NAMES[kind])
    for name, (left, _top, right, _bottom) in labels:
        assert 0 <= left < right <= 432, json.dumps(name)
        assert right - left <= text_width(name) + 2, json.dumps(name)
    for (name, (left, top, right, bottom)), (other, (left_2, top_2, right_2, bottom_2)) in combinations(labels, 2):
        assert right <= left_2 or right_2 <= left or bottom <= top_2 or bottom_2 <= top, (name, other)
