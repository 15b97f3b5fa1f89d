"""Names of detectors in plots, drawn by a browser: none on another one, none cut, whatever letters they have."""

import json

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
BOXES = """[...document.querySelectorAll('.lb')].map((one) => {
  const box = one.getBBox();
  return [box.x, box.x + box.width, box.y + 2, box.y + box.height - 2, one.textContent];
})"""


@pytest.mark.parametrize("kind", NAMES)
def test_names_drawn_by_a_browser_do_not_collide(kind, tmp_path):
    """Dots close to each other in a plot 432 pixels wide."""
    dots = [Dot(name, 0.05 + 0.01 * (k % 3), 0.3 * k) for k, name in enumerate(NAMES[kind])]
    plot = scatter(dots, alternative_text="", x_title="ms", y_axis=Axis("loss", [0, 1, 2]))
    page = environment().from_string(
        '{% import "show/report/parts.html" as parts %}<!doctype html><meta charset="utf-8"><style>{{ colours }}'
        '{% include "show/report/style.css" %}</style><div style="width:432px">{{ parts.plot(plot) }}</div>'
    )
    file = tmp_path / "plot.html"
    file.write_text(page.render(plot=plot), encoding="utf-8")
    with opened(file.as_uri(), tmp_path, (500, 300)) as browser:
        boxes = browser.ask(BOXES)
    assert boxes
    for left, right, _, _, name in boxes:
        assert 0 <= left < right <= 432, json.dumps(name)
        assert right - left <= text_width(name) + 2, json.dumps(name)
    for number, (left, right, top, bottom, name) in enumerate(boxes):
        for other in boxes[number + 1 :]:
            assert right <= other[0] or other[1] <= left or bottom <= other[2] or other[3] <= top, (name, other[4])
