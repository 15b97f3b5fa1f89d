import io
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from support.lettered_worlds import STATES, became, missed, run, stretches
from support.small_worlds import cubes, jumping

from replay.api.auditor import audit
from replay.cli import run_tables as module
from replay.cli.run_tables import audit_tables, cause_table, fault_tables, run_tables
from replay.cli.terminal import terminal
from replay.effects.effect_summary import happened_words
from replay.outputs.report.page import report_html
from replay.outputs.rerun_log.report import report_text
from replay.pipeline.engine import compute
from sessions import Scene
from sessions.model.scene import SceneBody, SceneEffect

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


def text(result, width=120):
    stream = io.StringIO()
    Console(file=stream, width=width).print(run_tables(result))
    return stream.getvalue()


def test_the_headline_counts_contacts_missed_and_names_both_detectors():
    shown = text(compute(cubes(PLACES), detectors="slow=discrete[rate_hz=20]", oracle="hybrid"))
    missed = "Looking 20 times a second missed 1 of 2 contacts here and part of 1 more"
    assert f"{missed}; 1.2 on average over look phases (oracle: hybrid)" in " ".join(shown.split())


def test_misses_stand_under_their_numbers_never_found_ones_first():
    places = {"a": [0] * 14, "b": [3, 0.9, 0.9, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3, 3, 3, 3]}
    result = compute(cubes(places), detectors="slow=discrete[rate_hz=25]", oracle="hybrid")
    kinds = {miss.number: miss.kind for miss in result.misses["slow"]}
    assert "never found" not in kinds.values() or len(kinds) > 0
    lines = text(result).splitlines()
    for miss in result.misses["slow"]:
        assert any(f"{miss.number} " in line and f" {miss.start:.3f} " in line and miss.kind in line for line in lines)


def test_long_lists_say_how_much_they_leave_out(monkeypatch):
    monkeypatch.setattr(module, "FAULT_ROWS", 1)
    result = compute(cubes(PLACES), detectors="slow=discrete[rate_hz=20]", oracle="hybrid")
    assert "… and 1 more with --format json" in text(result)
    assert "… and 1 more in misses.parquet" in text(replace(result, out=Path("run")))


def test_without_an_oracle_contacts_are_counted_per_detector():
    shown = text(compute(cubes(PLACES), detectors="sphere,hybrid", oracle="none"))
    assert "missed" not in shown.split("Exact about")[0]
    found = [line.split() for line in shown.splitlines() if "Contacts found by" in line or "a-b" in line]
    assert [row[-1] if "by" in row else row[:2] for row in found] == ["sphere", ["a-b", "2"], "hybrid", ["a-b", "2"]]


def test_proxies_and_the_limits_of_exactness_are_always_said():
    scene = Scene(bodies=(SceneBody("a", proxy=True),))
    shown = text(compute(cubes(PLACES, scene=scene), detectors="hybrid"), width=200)
    assert "Proxy meshes stand in for: a." in shown and "0.14-0.77 mm" in shown


def test_names_of_pairs_are_whole_in_a_terminal_of_80_columns():
    names = {"small-beaker": [0] * 12, "hand-left-glove": PLACES["b"]}
    shown = text(compute(cubes(names), detectors="slow=discrete[rate_hz=20]"), width=80)
    assert "small-beaker-hand-left-glove" in shown and "small-beaker - hand-left-glove" in shown


def test_the_answers_and_their_price_come_before_any_table():
    two = "slow=discrete[rate_hz=20],slower=discrete[rate_hz=10]"
    lines = text(compute(cubes(PLACES), detectors=two), width=200).splitlines()
    assert lines[1].startswith("slower: misses ")
    ranked = [line.split()[0] for line in lines[2:9] if line.startswith(("slow", "exact"))]
    assert ranked == ["slower", "slow", "exact"]
    means = next(k for k, line in enumerate(lines) if line.startswith("Means over 16 look phases: slower, slow"))
    assert lines[means + 2].startswith("The same algorithm at every frame costs")


def test_a_miss_that_no_frame_shows_says_so_and_when_they_touch():
    result = compute(jumping(), detectors="exact", oracle="continuous")
    (miss,) = result.misses["exact"]
    row = next(line for line in text(result).splitlines() if "never found" in line)
    assert "between frames" in row and f" {miss.touch.moment:.3f} " in row


def test_without_a_detector_what_happened_is_told_in_words():
    near = SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 0.2})
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b")), effects=(near,))
    result = compute(cubes({"a": [0.0] * 4, "b": [3.0, 3.0, 1.1, 3.0]}, scene=scene), detectors=())
    (line,) = happened_words(result.effects, 5)
    assert line in text(result).splitlines()


def test_counts_and_intervals_are_shown():
    places = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    found = audit([cubes(places), cubes(places)], detectors="slow=discrete[rate_hz=20],sphere")
    console = Console(width=150, record=True, file=StringIO())
    console.print(terminal(*audit_tables(found.summary)))
    text = console.export_text()
    assert "50 % [15, 85]" in text and "not asked" in text and "not examined" in text
    rows = [line.split() for line in text.splitlines()]
    assert ["slow", "between", "looks", "4"] in rows and ["sphere", "nothing", "missed"] in rows


def test_the_causes_are_named_the_most_frequent_first_and_sum_to_the_misses():
    causes = {"search": 2, "sampling": 0, "budget ran out": 1200}
    console = Console(width=150, record=True, file=StringIO())
    console.print(terminal(cause_table({"a-detector": {"causes": {"misses": causes}}})))
    assert "a-detector  budget ran out 1,200, search 2" in console.export_text()


def printed(shown, width):
    console = Console(width=width, record=True, file=StringIO())
    console.print(shown)
    return console.export_text()


def test_a_title_stays_on_its_line_over_a_narrow_table():
    text = printed(terminal(cause_table({"a": {"causes": {"misses": {"search": 2}}}})), 100)
    assert "why it missed: the first stage that lost the contact, with the number of misses\n" in text


def test_three_detectors_with_long_names_fit_into_80_columns_whole():
    places = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    found = audit(
        [cubes(places)], detectors="collider-capsule=discrete[rate_hz=20],collider-hull=sphere,recorded=hybrid"
    )
    text = printed(terminal(*audit_tables(found.summary)), 80)
    assert "…" not in text and "collider-capsule" in text
    rows = [line.split("  ") for line in text.splitlines() if line.strip().startswith(("false ", "starts late"))]
    assert len(rows) == 3 and all(len([cell for cell in row if cell.strip()]) >= 3 for row in rows)


def test_what_is_suspicious_about_units_comes_before_every_answer():
    far = {"a": [0.0] * 12, "b": [3000, 3000, 3000, 3000, 0.9, 3000, 3000, 3000, 0.9, 0.8, 0.9, 3000]}
    result = compute(cubes(far), detectors="hybrid")
    first, second = text(result, width=400).splitlines()[1:3]
    assert first.startswith("Warning, unit-suspect: positions look like millimetres") and "(b: 3000 m from" in first
    assert second.startswith("hybrid missed none of 2 contacts")
    for words in (report_text(result), report_html(result)):
        assert words.index("unit-suspect") < words.rindex("hybrid missed none of 2 contacts")


def test_every_miss_is_listed_with_its_cause_in_80_columns():
    names = {"small-beaker": [0] * 12, "hand-left": PLACES["b"]}
    result = compute(cubes(names), detectors="slow=discrete[rate_hz=20],hybrid,it=support.planted_detectors:Undecided")
    lines = printed(terminal(*fault_tables(result)), 80).splitlines()
    rows = [line.split() for line in lines if "small-beaker - hand-left" in line and "held since" not in line]
    assert {(row[0], row[1]) for row in rows} == {
        (str(miss.number), f"{miss.start:.3f}") for miss in result.misses["slow"]
    }
    assert all(" ".join(row[-2:]) == "between looks" for row in rows) and len(rows) == 2
    assert "missed by hybrid" not in " ".join(lines), "what missed nothing has no list"
    assert "missed by it" not in " ".join(lines), "what was left undecided was not missed"


def test_so_many_misses_of_a_detector_are_listed_and_it_says_how_many_more(monkeypatch):
    monkeypatch.setattr(module, "FAULT_ROWS", 1)
    missed, false = fault_tables(compute(cubes(PLACES), detectors="slow=discrete[rate_hz=20]"))
    assert len(missed.rows) == 1 and "… and 1 more with --format json" in printed(terminal(missed), 80).splitlines()
    assert len(false.rows) == 1 and false.title == "false contacts of slow" and not false.notes


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_of_the_terminal_holds_in_every_state(state):
    (truth, said, headline), result = STATES[state], run(state)
    outcome, (contacts, lost) = became(truth, said), missed(truth, said)
    shown = text(result, 200)
    assert f"\n{headline}  (oracle: exact)" in shown
    contact = [set(outcome[first : first + count]) for first, count, letter in stretches(truth) if letter == "C"]
    whole, parts = contact.count({"MISSED"}), contact.count({"MISSED", "both"})
    counts = [outcome.count(word) for word in ("both", "MISSED", "false")]
    rows = [line.split() for line in shown.replace("·", "0").splitlines() if line.startswith("a-b ")]
    expected = [["a-b", *map(str, (contacts, whole, parts, *counts))]] if contacts or any(counts) else []
    assert rows == expected
    wrong = [count for _, count, word in stretches(outcome) if word == "false"]
    assert sum(" a - b " in line for line in shown.splitlines()) == min(len(lost), 20) + len(wrong)
    listed = shown.partition("false contacts of it")[2].split("\n\n")[0]
    frames = [int(line.split()[5]) for line in listed.splitlines() if " a - b " in line]
    assert frames == sorted(wrong, reverse=True) and listed.count("unexplained") == len(wrong)
    assert (f"… and {len(lost) - 20} more with --format json" in shown) == (len(lost) > 20)
    figures = printed(terminal(*audit_tables(result.summary["audit"])), 200).replace("·", "0")
    rows = [line.split() for line in figures.splitlines()]
    assert [row for row in rows if row[:1] in (["both"], ["missed"], ["false"])][:3] == [
        ["both", str(counts[0])], ["missed", str(counts[1])], ["false", str(counts[2])]
    ]  # fmt: skip
    assert ("nothing missed" in figures) == (not lost)
