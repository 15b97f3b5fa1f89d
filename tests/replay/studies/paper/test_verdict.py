"""Every number in a sentence stands in a table, and changes with it."""

import re

import pytest

from replay.outputs.paper_table import PaperTable
from replay.studies.paper.verdict import verdict_of


@pytest.mark.slow
def test_there_is_a_sentence_for_completion_caps_frames_and_per_family_colony_ablation_and_samples(small):
    said = verdict_of(small.tables)
    assert [re.match(r"[^:,]+", one).group() for one in said] == [
        "T1a", "T1c", "T1d", "F7e", "F7e", "Ablation", "Ablation", "F8", "F8",
    ]  # fmt: skip
    for name in ("exact", "rapid-style", "solid-style", "aabb", "obb", "hybrid-qaco mesh"):
        assert name in said[0]


@pytest.mark.slow
def test_a_row_that_lost_a_pair_is_no_longer_named_as_complete(small):
    def with_loss(table):
        if table.key != "T1a":
            return table
        place = table.head.index("poses with every pair")
        rows = [list(row) for row in table.rows]
        rows[[row[0] for row in rows].index("obb")][place] -= 1
        return PaperTable(table.key, table.title, table.head, tuple(map(tuple, rows)), table.note)

    assert re.search(r"\bobb\b", verdict_of(small.tables)[0])
    assert not re.search(r"\bobb\b", verdict_of([with_loss(one) for one in small.tables])[0])


@pytest.mark.slow
def test_the_numbers_of_the_colony_are_those_of_its_table(small):
    rates = next(one for one in small.tables if one.key == "F7e")
    said = next(one for one in verdict_of(small.tables) if one.startswith("F7e, torus-sphere"))
    for row in rates.rows:
        if row[0] == "torus-sphere" and row[1] in ("exact", "qaco memetic", "qaco random"):
            assert f"{row[1]} {row[3]}" in said and f"of {row[2]} contacts" in said
