from dataclasses import replace
from io import StringIO

from rich.console import Console
from small_worlds import cubes

from replay.auditor import audit
from replay.cli.audit_tables import answers, audit_tables, cause_table


def test_counts_and_intervals_are_shown():
    places = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    found = audit([cubes(places), cubes(places)], detectors="slow=discrete[rate_hz=20],sphere")
    console = Console(width=150, record=True, file=StringIO())
    console.print(audit_tables(found.summary))
    text = console.export_text()
    assert "50 % [15, 85]" in text and "not asked" in text and "not examined" in text
    rows = [line.split() for line in text.splitlines()]
    assert ["slow", "between", "looks", "4"] in rows and ["sphere", "nothing", "missed"] in rows


def test_the_causes_are_named_the_most_frequent_first_and_sum_to_the_misses():
    causes = {"search": 2, "sampling": 0, "budget ran out": 1200}
    console = Console(width=150, record=True, file=StringIO())
    console.print(cause_table({"a-detector": {"causes": {"misses": causes}}}))
    assert "a-detector   budget ran out 1,200, search 2" in console.export_text()


def printed(shown, width):
    console = Console(width=width, record=True, file=StringIO())
    console.print(shown)
    return console.export_text()


def test_the_answer_comes_first_and_names_the_session_where_there_are_several():
    places = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    one = replace(cubes(places), origin="first.mcap")
    alone = audit([one], detectors="slow=discrete[rate_hz=20]")
    text = printed(answers(alone.results), 200)
    assert "1 of 2 contacts missed by slow, 1 more in part   oracle: exact" in text and "first.mcap" not in text
    assert "Every contact counted here was found by exact in" in text
    both = audit([one, replace(one, origin="second.mcap")], detectors="slow=discrete[rate_hz=20]")
    lines = printed(answers(both.results), 200).split()
    assert lines.index("first.mcap") < lines.index("missed") < lines.index("second.mcap")


def test_a_title_stays_on_its_line_over_a_narrow_table():
    text = printed(cause_table({"a": {"causes": {"misses": {"search": 2}}}}), 100)
    assert "why it missed: the first stage that lost the contact, with the number of misses\n" in text


def test_three_detectors_with_long_names_fit_into_80_columns_whole():
    places = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    found = audit(
        [cubes(places)], detectors="collider-capsule=discrete[rate_hz=20],collider-hull=sphere,recorded=hybrid"
    )
    text = printed(audit_tables(found.summary), 80)
    assert "…" not in text and "collider-capsule" in text
    rows = [line.split("  ") for line in text.splitlines() if line.strip().startswith(("invented ", "begin off"))]
    assert len(rows) == 3 and all(len([cell for cell in row if cell.strip()]) >= 3 for row in rows)
