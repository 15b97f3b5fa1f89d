"""An engine answers as its re-creation does, but near where contact begins; the page's tables are the command's."""

import pytest
from support.optional import DATA, ENGINE_MODULE, needs_data
from support.processes import script

from replay.guide.pages import page
from replay.prepare.assemble import assemble
from sessions.synthetic.scenes import make_scene_session

command = script("real_engines")
BEGIN, END, RECORDINGS, TWINS = command.BEGIN, command.END, command.RECORDINGS, command.TWINS
with_table = command.with_table


@pytest.fixture(scope="module")
def assembly_of_four_seconds():
    """Bodies, pairs and motion of 10 to 14 s of the made-up bench."""
    session = make_scene_session("bench-bumps")[0]
    first = int(session.frames.stamp_ns[0])
    return assemble(session.between(first + 10 * 10**9, first + 14 * 10**9))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("twin", "skin", "early_mm", "late_mm"),
    [
        ("rapier[prediction_m=0.02]", 0.01, 0.0, 3.0),
        ("bullet[margin_m=0.001]", 0.001, 4.0, 0.0),
        ("physx[contact_offset_m=0.01]", 0.01, 1.0, 1.0),
    ],
)
def test_engine_and_re_creation_differ_only_where_contact_begins(
    twin, skin, early_mm, late_mm, assembly_of_four_seconds
):
    """Both report contact where two hulls, each with a skin, touch; an engine up to so much earlier or later."""
    pytest.importorskip(ENGINE_MODULE[twin.partition("[")[0]])
    counts = command.compare_twins(assembly_of_four_seconds, twin, f"collider[shape=hull,skin_m={skin}]")
    posed = int(assembly_of_four_seconds.motion.valid[:, assembly_of_four_seconds.pairs].all(axis=2).sum())
    assert counts.equal + counts.engine_only + counts.ours_only == posed and counts.both > 100
    assert counts.equal / posed > 0.999 and counts.not_supported == 0
    if counts.gaps_mm is not None:
        two_skins_mm = 1000 * 2 * skin
        least_gap_mm, largest_gap_mm = counts.gaps_mm
        assert two_skins_mm - late_mm <= least_gap_mm and largest_gap_mm <= two_skins_mm + early_mm


@pytest.mark.slow
def test_pair_frames_an_engine_cannot_test_are_not_supported(assembly_of_four_seconds):
    pytest.importorskip("pybullet")
    counts = command.compare_twins(
        assembly_of_four_seconds, "bullet[shape=mesh,margin_m=0.001]", "collider[shape=mesh,skin_m=0.001]"
    )
    assert counts.not_supported > 1000 and counts.ours_only == 0
    posed = int(assembly_of_four_seconds.motion.valid[:, assembly_of_four_seconds.pairs].all(axis=2).sum())
    assert counts.equal + counts.engine_only + counts.not_supported == posed


def test_page_has_a_table_of_every_twin_per_session():
    made = with_table(page("results"), "", BEGIN, END)
    tables = page("results")[made.index(BEGIN) :].split("### ")[1:]
    assert len(tables) == 1 + len(RECORDINGS)
    for twin in TWINS:
        assert sum(f"| `{twin.engine}` | `{twin.ours}` |" in table for table in tables) == (3 if twin.dense else 1)


def test_twin_table_row_lists_counts_gaps_and_times():
    """1,005 pair-frames were decided by both: 1,000 alike, and 2 and 3 unlike."""
    separate = command.TwinCounts(
        equal=1000, both=10, engine_only=2, ours_only=3, not_supported=4, gaps_mm=(0.04, 19.96)
    )
    table = command.twin_table("one", {command.Twin("rapier", "collider"): separate})
    assert table.splitlines()[-1] == "| `rapier` | `collider` | 1,005 | 10 | 2 | 3 | 0.0 to 20.0 | 4 |"


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("twin", [twin for twin in TWINS if twin.dense], ids=lambda twin: twin.engine)
def test_a_recording_gives_its_row_of_the_page_again(twin, recordings):
    pytest.importorskip(ENGINE_MODULE[twin.engine.partition("[")[0]])
    name, assembly = recordings
    row = command.twin_table(name, {twin: command.compare_twins(assembly, twin.engine, twin.ours)}).splitlines()[-1]
    assert row in page("results").partition(f"### {name}")[2].partition("### ")[0]


@pytest.fixture(scope="module")
def recordings():
    """The first session of recordings that the script compares."""
    return next((name, item) for name, item in command.sessions(DATA) if name == f"`{RECORDINGS[0]}`")
