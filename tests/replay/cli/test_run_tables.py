import io
from io import StringIO

import pytest
from rich.console import Console
from support.lettered_worlds import STATES, became, missed, run, stretches
from support.small_worlds import cubes

from replay.cli.run_tables import audit_tables, run_tables
from replay.cli.terminal import terminal
from replay.outputs.report.page import report_html
from replay.outputs.rerun_log.report import report_text
from replay.pipeline.engine import compute
from sessions import Scene
from sessions.model.scene import SceneBody

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


def text(result, width=120):
    stream = io.StringIO()
    Console(file=stream, width=width).print(run_tables(result))
    return stream.getvalue()


def test_the_headline_counts_contacts_missed_and_names_both_detectors():
    shown = text(compute(cubes(PLACES), detectors="slow=discrete[rate_hz=20]", oracle="hybrid"))
    missed = "Looking 20 times a second missed 1 of 2 contacts here and part of 1 more"
    assert f"{missed}; 1.2 on average over look phases (oracle: hybrid)" in " ".join(shown.split())


def test_without_an_oracle_contacts_are_counted_per_detector():
    shown = text(compute(cubes(PLACES), detectors="sphere,hybrid", oracle="none"))
    assert "missed" not in shown.split("Exact about")[0]
    found = [line.split() for line in shown.splitlines() if "Contacts found by" in line or "a-b" in line]
    assert [row[-1] if "by" in row else row[:2] for row in found] == ["sphere", ["a-b", "2"], "hybrid", ["a-b", "2"]]


def test_proxies_and_the_limits_of_exactness_are_always_said():
    scene = Scene(bodies=(SceneBody("a", proxy=True),))
    shown = text(compute(cubes(PLACES, scene=scene), detectors="hybrid"), width=200)
    assert "Proxy meshes stand in for: a." in shown and "0.14-0.77 mm" in shown


def test_the_answers_and_their_price_come_before_any_table():
    two = "slow=discrete[rate_hz=20],slower=discrete[rate_hz=10]"
    lines = text(compute(cubes(PLACES), detectors=two), width=200).splitlines()
    assert lines[1].startswith("slower: misses ")
    ranked = [line.split()[0] for line in lines[2:9] if line.startswith(("slow", "exact"))]
    assert ranked == ["slower", "slow", "exact"]
    means = next(k for k, line in enumerate(lines) if line.startswith("Means over 16 look phases: slower, slow"))
    assert lines[means + 2].startswith("The same algorithm at every frame costs")


def printed(shown, width):
    console = Console(width=width, record=True, file=StringIO())
    console.print(shown)
    return console.export_text()


def test_what_is_suspicious_about_units_comes_before_every_answer():
    far = {"a": [0.0] * 12, "b": [3000, 3000, 3000, 3000, 0.9, 3000, 3000, 3000, 0.9, 0.8, 0.9, 3000]}
    result = compute(cubes(far), detectors="hybrid")
    first, second = text(result, width=400).splitlines()[1:3]
    assert first.startswith("Warning, unit-suspect: positions look like millimetres") and "(b: 3000 m from" in first
    assert second.startswith("hybrid missed none of 2 contacts")
    for words in (report_text(result), report_html(result)):
        assert words.index("unit-suspect") < words.rindex("hybrid missed none of 2 contacts")


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
