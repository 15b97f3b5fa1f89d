"""Tables of the page, and how text becomes markup."""

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.page_cells import Cells
from support.small_tables import made
from support.small_worlds import cubes

from replay.outputs.report.faults import choices, miss_cards
from replay.outputs.report.markup import element, page_table, rendered, safe
from replay.outputs.report.tables import contact_tables, fact_table
from replay.pipeline.engine import compute


def test_facts_name_every_body_and_the_length(run):
    text = rendered(fact_table(run))
    assert all(f"{body.name} ({len(body.mesh.faces):,} faces)" in text for body in run.assembly.bodies)
    assert f"{len(run.assembly.motion):,} frames" in text
    session = {**run.summary["session"], "facts": {"headset_model": "VIVE Pro", "room": "not stated"}}
    text = rendered(fact_table(replace(run, summary={**run.summary, "session": session})))
    assert "headset model" in text and "VIVE Pro" in text and "room" not in text and "not stated" not in text


@pytest.fixture(scope="module")
def many(run):
    """The run as if it had missed 1,100 contacts, some of them one after the other."""
    one = run.misses["slow"][0]
    at = {k: 0.5 * k + 20 * (k // 50) for k in range(1, 1101)}
    made = (replace(one, number=k, start=at[k], end=at[k], cut_length=k * 7 % 1103 / 1e3) for k in at)
    return replace(run, misses={"slow": tuple(made)})


def text_of(parts):
    return "".join(map(rendered, parts))


def test_hundreds_of_misses_are_clusters_first_and_rows_deepest_first_in_a_fold(many):
    text = text_of(miss_cards(many, "slow", choices(many)))
    tables = Cells(text).tables
    (caption,) = [name for name in tables if "clusters" in name]
    assert caption == f"1,100 misses of slow in {len(tables[caption])} clusters, longest cut first"
    assert all(
        row[2] == f"replay view RUN --miss {one} --by slow" for row in tables[caption] for one in [row[2].split()[4]]
    )
    assert len(tables[caption]) <= 40 and sum(int(row[3]) for row in tables[caption]) == 1100
    deepest = [float(row[6]) for row in tables[caption]]
    assert deepest == sorted(deepest, reverse=True)
    assert text.index(caption) < text.index("<details>") < text.index("What slow missed")
    cuts = [float(row[6]) for row in tables["What slow missed"]]
    assert len(cuts) == 1000 and cuts == sorted(cuts, reverse=True)
    assert "The worst 1,000, each with the command that shows it; the other 100 are in misses.parquet" in text


def test_a_few_misses_are_rows_and_nothing_else(run):
    text = text_of(miss_cards(run, "slow", choices(run)))
    assert "<details>" not in text and len(Cells(text).tables) == 1


def test_the_pair_with_the_most_missed_frames_comes_first():
    places = {"a": [0] * 12, "b": [0.9, 0.9, 0.9, *[3] * 9], "c": [-3, -3, -3, -3, -0.9, -0.9, -3, -3, -3, -3, -3, -3]}
    result = compute(cubes(places), detectors="slow=discrete[rate_hz=10]")
    text = text_of(contact_tables(result))
    missed = [int(one) for one in re.findall(r'(?:<td class="number">[^<]*</td>){5}<td class="number">(\d+)', text)]
    assert len(missed) == 2 and missed[0] > missed[1], text
    assert text.index(">a-c<") < text.index(">a-b<")


@given(st.text())
def test_no_text_becomes_an_element(text):
    assert "<" not in safe(text) and "<" not in element("p", text)[3:-4]
    assert element("p", "x", title=text).count('"') == 2


def test_a_page_keeps_numbers_plain():
    text = page_table(made(words=("body",)))
    assert Cells(text).tables == {"a title": [["cup|lid", "1234", "7"], ["rod", "0", "x\nwhy"]]}
    assert "<b>7</b>" in text and "<code>x</code>" in text and "<p>a note</p>" in text
