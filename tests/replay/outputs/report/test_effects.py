import pytest
from support.small_worlds import cubes

from replay.effects.effect_summary import happened_words
from replay.outputs.report.markup import rendered
from replay.outputs.report.page import report_html
from replay.outputs.report.tables import EVENT_ROWS, effect_parts
from replay.pipeline.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect

BETWEEN = {"between": ["a", "b"]}


def run(places, *effects):
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b")), effects=effects)
    return compute(cubes({"a": [0.0] * len(places), "b": places}, scene=scene), detectors=())


@pytest.fixture(scope="module")
def result():
    places = [3.0] * 8 + [0.9] * 4 + [3.0] * 4
    return run(places, SceneEffect("breakage", {**BETWEEN, "speed_m_s": 1.0}))


def test_the_page_says_what_ran_why_at_what_price_and_what_did_not(result):
    page = report_html(result)
    for words in (
        "Effects that the scene calls for", "breakage needs it", "% of the run", "% skipped", "the begin of a contact",
        "Not called for, so not imported and not run: ",
    ):  # fmt: skip
        assert words in page, words
    assert "No collision query was made." not in page


def test_events_stand_in_order_of_time_and_a_long_list_is_cut_and_says_so():
    flicker = run(([0.9] * 2 + [3.0] * 2) * (EVENT_ROWS + 5), SceneEffect("contact", BETWEEN))
    section = "".join(map(rendered, effect_parts(flicker)))
    assert (
        f"the first {EVENT_ROWS} of {EVENT_ROWS + 5}" in section
        and section.count('<td class="word">a touches b') == EVENT_ROWS
    )


def test_a_run_without_a_contact_says_that_none_was_looked_for():
    page = report_html(
        run([3.0, 3.0, 1.1, 3.0], SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 0.2}))
    )
    assert "No collision query was made." in page and "mm of b" in page


def test_a_page_without_effects_has_no_such_section():
    assert "Effects that the scene" not in report_html(compute(cubes({"a": [0, 0], "b": [3, 0.9]}), detectors="hybrid"))


def test_without_a_detector_the_page_begins_with_what_happened():
    near = SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 0.2})
    result = run([3.0] * 20 + [1.1] + [3.0] * 40 + [1.1, 3.0], near)
    page = report_html(result)
    first = page[: page.index("</header>")]
    one, two = happened_words(result.effects, 5)
    assert f"<h1>{result.effects['hazard-proximity'].events[0].name}: 2</h1>" in first
    assert first.index(one) < first.index(two) < first.index("No contact was looked for")
