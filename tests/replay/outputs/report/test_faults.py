"""Faults as cards: each has its place, its price and its address, and a reader chooses without a script."""

import re
from collections import Counter

import pytest
from support.browser import opened
from support.page_cells import NUMBER, Cells, said_in, shown_as, values_of
from support.small_worlds import cubes, jumping

from replay.comparison.clusters import clusters
from replay.outputs.report.faults import choices
from replay.outputs.report.page import report_html
from replay.outputs.results.fault_tables import false_table, miss_table
from replay.outputs.results.parquet_tables import event_table
from replay.pipeline.engine import compute
from replay.pipeline.ranking import ranking
from sessions.model.scene import Scene, SceneBody, SceneEffect

PLACES = {"a": [0.0] * 8, "b": [3, 0.9, 3, 3, 3, 3, 3, 3], "c": [-3, -3, -3, -0.9, -3, -0.9, -0.9, -3]}
"""At 100 Hz; looks at 50 Hz fall on even frames: they miss a-b and a-c whole, find a-c late, and hold it too long."""


@pytest.fixture(scope="module")
def result():
    return compute(cubes(PLACES), detectors="slow=discrete[rate_hz=50],more=discrete[rate_hz=25]", oracle="exact")


@pytest.fixture(scope="module")
def page(result):
    return report_html(result)


def cards(page):
    """Address -> attributes of every card."""
    rows = re.findall(r"<tr (?=[^>]*id=)([^>]*)>", page.replace("&amp;", "&"))
    return {found["id"]: found for found in (dict(re.findall(r'([\w-]+)="([^"]*)"', one)) for one in rows)}


def test_every_fault_of_every_detector_is_one_card_with_its_own_address(result, page):
    asked = {f"miss={one.number}" for one in result.misses["slow"]} | {
        f"false={one.number}" for one in result.false["slow"]
    }
    for label, kind, found in (("more", "miss", result.misses["more"]), ("more", "false", result.false["more"])):
        asked |= {f"{kind}={one.number}&by={label}" for one in found}
    assert len(asked) > 5 and cards(page).keys() == asked
    assert asked <= set(re.findall('<a href="#([^"]*)"', page.replace("&amp;", "&")))
    rows = [row for caption, rows in Cells(page).tables.items() if caption == "What more missed" for row in rows]
    assert [row[8] for row in rows] == [f"replay view RUN --miss {row[0]} --by more" for row in rows] and rows


def test_what_a_card_can_be_chosen_by_is_what_it_shows(result, page):
    offered = choices(result)
    names = {"miss": "missed", "false": "false"}
    for address, card in cards(page).items():
        kind, _, rest = address.partition("=")
        number, _, by = rest.partition("&by=")
        found = result.misses if kind == "miss" else result.false
        (one,) = (one for one in found[by or "slow"] if one.number == int(number))
        shown = (by or "slow", names[kind], f"{one.body_a} - {one.body_b}", one.cause)
        assert list(offered) == ["detector", "kind", "pair", "cause"]
        assert [values[int(card[f"data-{name}"]) - 1] for name, values in offered.items()] == [*shown]
        assert f"--time:{round(1000 * one.start)};" in card["style"]


def test_the_larger_fault_of_a_detector_and_the_worst_detector_come_first(result, page):
    apart = cubes({"a": [0.0] * 18, "b": [3, 0.9, 3, 3, 0.9, 0.9, 0.9, 3, *[1.02] * 8, 3, 3]})
    asked = "few=discrete[rate_hz=50],box=collider[shape=box,skin_m=0.05]"
    for made in (result, compute(apart, detectors=asked, oracle="exact")):
        ranks, text = ranking(made.summary)[:-1], report_html(made)
        kinds = [("false contact", "miss") if one.leads_false else ("miss", "false contact") for one in ranks]
        named = {"miss": made.misses, "false contact": made.false}
        asked = [f"Every {kind} of {one.label}" for one, two in zip(ranks, kinds, strict=True) for kind in two
                 if named[kind][one.label]]  # fmt: skip
        asked += [f"When: {one.label}" for one in ranks]
        titles = [title for title in re.findall("<h2>([^<]*)</h2>", text) if title.startswith(("Every", "When"))]
        assert titles == asked and len(asked) >= 4
        made_of = [one for one in Cells(text).tables if " made of them" in one and "each detector" not in one]
        assert [one.split("what ")[1].split(" made")[0] for one in made_of] == [one.label for one in ranks]
    assert ranks[0].leads_false and next(iter(made.comparisons)) != ranks[0].label


def test_what_has_one_value_cannot_be_chosen_and_a_page_without_a_fault_has_no_choice():
    one = report_html(compute(cubes({"a": PLACES["a"], "b": PLACES["b"]}), detectors="slow=discrete[rate_hz=50]"))
    assert 'id="miss=1"' in one and "<select" not in one
    none = report_html(compute(cubes({"a": [0.0] * 3, "b": [3.0, 2.0, 3.0]}), detectors="slow=discrete[rate_hz=50]"))
    assert "<select" not in none and "cards" not in re.sub("<style>.*?</style>", "", none, flags=re.DOTALL)


EFFECTS = Scene(
    bodies=(SceneBody("a"), SceneBody("b")), effects=(SceneEffect("contact", {"between": ["a", "b"]}),)
)  # fmt: skip
STATES = pytest.mark.parametrize(
    ("session", "asked"),
    [
        (cubes(PLACES), {"detectors": "slow=discrete[rate_hz=50],more=discrete[rate_hz=25]", "oracle": "exact"}),
        (cubes({"a": [0.0] * 3, "b": [3.0, 2.0, 3.0]}), {"detectors": "slow=discrete[rate_hz=50]"}),
        (
            cubes({"a": [0.0] * 6, "b": [3.0, 1.02, 1.01, 1.02, 3.0, 3.0]}),
            {"detectors": "collider[shape=box,skin_m=0.05]"},
        ),
        (jumping(), {"detectors": "exact", "oracle": "continuous"}),
        (cubes({"a": [0.0] * 12, "b": [0.99, 0.99, 3.0, 3.0] * 3}, scene=EFFECTS), {"detectors": ()}),
        (cubes(PLACES), {"detectors": "exact,sphere", "oracle": "none"}),
        (cubes({"a": [0.0] * 200, "b": [3.0, 0.9, 3.0, 3.0] * 50}), {"detectors": "slow=discrete[rate_hz=50]"}),
    ],
    ids=["several", "none", "only false", "between frames", "effects", "not audited", "more than 40"],
)


SHOWN = {}


def shown_once(session, asked):
    """The result of a state and its page, made once for all tests of it."""
    if id(session) not in SHOWN:
        result = compute(session, **asked)
        SHOWN[id(session)] = result, report_html(result)
    return SHOWN[id(session)]


def rows_of(table):
    """Rows of a table of contacts, with what follows of them: frames, or of events their seconds."""
    found = table.to_pylist()
    return [row | ({"frames": row["last"] - row["first"] + 1} if "first" in row else {}) for row in found]


HEADS = {90.0, 95.0, 99.0, 1000 / 90}
"""What only titles of columns say: quantiles, and the frame of a headset."""


@STATES
def test_every_number_of_the_page_is_in_the_summary_or_in_a_table(session, asked):
    result, made = shown_once(session, asked)
    text, told = said_in(made), result.summary
    rows = [rows_of(table(result)) for table in (miss_table, false_table, event_table)]
    groups = [
        (
            len(one.misses),
            one.frames,
            one.deepest.number,
            *one.span,
            *Counter(miss.cause for miss in one.misses).values(),
        )
        for found in result.misses.values()
        for one in clusters(found)
    ]
    contacts = told["detectors"].get(told["oracle"], {"contacts": 0})["contacts"]
    phases = (one.get("phases", {}) for one in told["audit"].values())
    ends = [kind[end] * contacts for one in phases for kind in one.values() for end in ("low", "high")]
    numbers = {*values_of(told), *HEADS, *ends, *values_of([*rows, *map(list, groups)])}
    assert [one for one in NUMBER.findall(text) if not shown_as(one, numbers)] == []
    assert len(NUMBER.findall(text)) > 40


@pytest.mark.slow
def test_a_browser_shows_what_was_chosen_in_the_order_asked_for(result, page, tmp_path):
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    shown = "[...document.querySelectorAll('.cards tbody tr')].filter(one => one.offsetParent)"
    with opened((tmp_path / "page.html").as_uri(), tmp_path) as browser:
        count = browser.ask(f"{shown}.length")
        assert count == len(cards(page))
        pair = choices(result)["pair"].index("a - b") + 1
        browser.ask(f"document.getElementById('by-pair').value = '{pair}'")
        of_pair = sum(card["data-pair"] == str(pair) for card in cards(page).values())
        assert 0 < of_pair == browser.ask(f"{shown}.length") < count
        browser.ask("document.getElementById('by-pair').value = ''; document.getElementById('by-order').value = 'time'")
        place = "one.closest('table').caption.innerText, one.offsetTop, one.offsetLeft"
        tops = browser.ask(f"{shown}.map(one => [{place}, +one.style.getPropertyValue('--time')])")
        assert [one[3] for one in sorted(tops)] == [one[3] for one in sorted(tops, key=lambda one: (one[0], one[3]))]
        assert not browser.errors()


@pytest.mark.slow
@pytest.mark.parametrize("width", [400, 800, 1280, 1600])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_clipped_at_any_width(page, tmp_path, width, scheme):
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    with opened((tmp_path / "page.html").as_uri(), tmp_path, (width, 800), scheme) as browser:
        browser.ask("for (const one of document.querySelectorAll('details')) one.open = true")
        assert browser.ask("document.documentElement.scrollWidth <= innerWidth")
        # What is wider than its place can be moved, by keys too.
        script = "[...document.querySelectorAll('table, svg, img, code')].filter(one => !one.closest('[tabindex]') && "
        assert browser.ask(f"{script} one.getBoundingClientRect().right > innerWidth).map(one => one.outerHTML)") == []
        assert browser.ask("document.querySelector('h1').getBoundingClientRect().bottom < 800")
