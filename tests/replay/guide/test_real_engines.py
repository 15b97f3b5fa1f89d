"""The tables of engines are those that the committed command makes."""

import pytest
from support.shared_data import DATA, needs_data

from cdcore.detectors import ENGINE_MODULE
from replay.detection.engine_twin import TwinCounts, compare_twins
from replay.guide import real_engines
from replay.guide.choosing import with_table
from replay.guide.pages import page
from replay.guide.real_engines import BEGIN, END, RECORDINGS, TWINS, Twin, twin_table


def test_the_page_has_a_table_of_every_twin_for_each_session():
    made = with_table(page("real-engines"), "", BEGIN, END)
    tables = page("real-engines")[made.index(BEGIN) :].split("### ")[1:]
    assert len(tables) == 1 + len(RECORDINGS)
    for twin in TWINS:
        assert sum(f"| `{twin.engine}` | `{twin.ours}` |" in table for table in tables) == (3 if twin.dense else 1)


def test_a_row_says_what_differs_and_where():
    same, apart = TwinCounts(90, 10, 0, 0, 0, None), TwinCounts(1000, 10, 2, 3, 4, (0.04, 19.96))
    twin = Twin("rapier", "collider")
    assert twin_table("one", {twin: same}).splitlines()[-1] == "| `rapier` | `collider` | 90 | 10 | 0 | 0 | - | 0 |"
    assert twin_table("one", {twin: apart}).endswith("| 1,005 | 10 | 2 | 3 | 0.0 to 20.0 | 4 |")


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("twin", [twin for twin in TWINS if twin.dense], ids=lambda twin: twin.engine)
def test_a_recording_gives_its_row_of_the_page_again(twin, recordings):
    pytest.importorskip(ENGINE_MODULE[twin.engine.partition("[")[0]])
    name, assembly = recordings
    row = twin_table(name, {twin: compare_twins(assembly, twin.engine, twin.ours)}).splitlines()[-1]
    assert row in page("real-engines").partition(f"### {name}")[2].partition("### ")[0]


@pytest.fixture(scope="module")
def recordings():
    return next((name, one) for name, one in real_engines.sessions(DATA) if name == f"`{RECORDINGS[0]}`")
