"""What a curve of the report shows is where its points are."""

import re

import replay
from replay.outputs.plots import curve
from replay.outputs.report.charts import drawn
from replay.outputs.report.page import report_html


def heights(markup):
    """Heights of the corners of a curve, in the units of its drawing, from the first to the last."""
    path = re.search(r'class="curve" d="M([^"]*)"', str(markup))[1]
    return [float(corner.split()[1]) for corner in path.split("L")]


def test_a_curve_that_jumps_after_a_long_rest_is_level_until_it_jumps():
    points = [(k / 90, 20.0 if k < 4000 else 24.0) for k in range(5400)]
    found = heights(drawn(curve([(0.0, 20.0), *points[3990:]], (), "words", "s", "degC", 20.0)))
    assert len(found) == 4 and found[0] == found[1] > found[2] == found[3]


def test_a_calorimeter_has_its_temperature_as_headline_and_as_the_first_curve():
    session, _ = replay.synthetic_session("ammonia-calorimetry")
    page = report_html(replay.run(session))
    captions = re.findall(r"<figcaption>(The (?:temperature|pH)[^<]*)</figcaption>", page)
    assert captions[0].startswith("The temperature of calorimeter: 20.00 to 24.4")
    assert "warms from 20.00 to 24.4" in page[: page.index(captions[0])]
