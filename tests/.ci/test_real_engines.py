"""An engine answers as its re-creation does, but near where contact begins; the page's tables are the command's."""

import pytest
from support.optional import DATA, ENGINE_MODULE, needs_data
from support.processes import script

from replay.guide.pages import page
from replay.prepare.assemble import assemble
from sessions.synthetic.scenes import make_scene_session

command = script("real_engines")
BEGIN, END, RECORDINGS, TWINS = command.BEGIN, command.END, command.RECORDINGS, command.TWINS


@pytest.fixture(scope="module")
def assembly_of_four_seconds():
    """Bodies, pairs and motion of 10 to 14 s of the made-up bench."""
    session = make_scene_session("bench-bumps")[0]
    first = int(session.frames.stamp_ns[0])
    return assemble(session.between(first + 10 * 10**9, first + 14 * 10**9))


def pair_frames_with_poses(assembly):
    """The number of frames of a pair in which both bodies have a pose, over all pairs."""
    return int(assembly.motion.valid[:, assembly.pairs].all(axis=2).sum())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "skin_m", "most_early_mm", "most_late_mm"),
    [
        ("rapier[prediction_m=0.02]", 0.01, 0.0, 3.0),
        ("bullet[margin_m=0.001]", 0.001, 4.0, 0.0),
        ("physx[contact_offset_m=0.01]", 0.01, 1.0, 1.0),
    ],
)
def test_engine_and_re_creation_differ_only_where_contact_begins(
    engine, skin_m, most_early_mm, most_late_mm, assembly_of_four_seconds
):
    """A re-creation reports contact of hulls from a gap of two skins on; the engine up to so much earlier or later.

    In four seconds of the made-up bench over 100 pair-frames are contact for both, and more than 99.9 % of all have
    the same answer. The gaps of those that differ lie within these bounds, by measurement (see the page "results").
    """
    pytest.importorskip(ENGINE_MODULE[engine.partition("[")[0]])
    re_creation = f"collider[shape=hull,skin_m={skin_m}]"
    counts = command.compare_twins(assembly_of_four_seconds, engine, re_creation)
    pair_frames = pair_frames_with_poses(assembly_of_four_seconds)
    assert counts.equal + counts.engine_only + counts.ours_only == pair_frames
    assert counts.not_supported == 0
    assert counts.both > 100
    assert counts.equal / pair_frames > 0.999
    if counts.gaps_mm is not None:
        two_skins_mm = 1000 * 2 * skin_m
        least_gap_mm, largest_gap_mm = counts.gaps_mm
        assert two_skins_mm - most_late_mm <= least_gap_mm
        assert largest_gap_mm <= two_skins_mm + most_early_mm


@pytest.mark.slow
def test_pair_frames_an_engine_cannot_test_are_not_supported(assembly_of_four_seconds):
    """Bullet does not test mesh against mesh: more than 1000 such contacts are not supported, and none is missed.

    With the pair-frames that both decide, and those of the engine alone, they are all that have poses, in four seconds
    of the made-up bench.
    """
    pytest.importorskip("pybullet")
    counts = command.compare_twins(
        assembly_of_four_seconds, "bullet[shape=mesh,margin_m=0.001]", "collider[shape=mesh,skin_m=0.001]"
    )
    assert counts.not_supported > 1000
    assert counts.ours_only == 0
    pair_frames = pair_frames_with_poses(assembly_of_four_seconds)
    assert counts.equal + counts.engine_only + counts.not_supported == pair_frames


def test_page_has_a_table_of_every_twin_per_session():
    """The page "results" has a table of the made-up bench and of each recording.

    An engine and its re-creation ("twin") are a row of the first, and, if ``dense``, of two recordings as well.
    """
    tables = page("results")[page("results").index(BEGIN) :].split("### ")[1:]
    assert len(tables) == 1 + len(RECORDINGS)
    for twin in TWINS:
        tables_with_row = sum(f"| `{twin.engine}` | `{twin.ours}` |" in table for table in tables)
        assert tables_with_row == (3 if twin.dense else 1)


def test_twin_table_row_lists_counts_gaps_and_times():
    """Both decided 1,000 pair-frames alike, 10 of them contact, and 2 + 3 unlike: 1,005, at gaps of 0.04 to 19.96 mm.

    The engine could not test another four.
    """
    counts = command.TwinCounts(equal=1000, both=10, engine_only=2, ours_only=3, not_supported=4, gaps_mm=(0.04, 19.96))
    table = command.twin_table("a recording", {command.Twin("rapier", "collider"): counts})
    assert table.splitlines()[-1] == "| `rapier` | `collider` | 1,005 | 10 | 2 | 3 | 0.0 to 20.0 | 4 |"


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("twin", [twin for twin in TWINS if twin.dense], ids=lambda twin: twin.engine)
def test_a_recording_gives_its_row_of_the_page_again(twin, first_recording):
    """The row of an engine and its re-creation in the first recording's table of the page."""
    pytest.importorskip(ENGINE_MODULE[twin.engine.partition("[")[0]])
    name, assembly = first_recording
    row = command.twin_table(name, {twin: command.compare_twins(assembly, twin.engine, twin.ours)}).splitlines()[-1]
    assert row in page("results").partition(f"### {name}")[2].partition("### ")[0]


@pytest.fixture(scope="module")
def first_recording():
    """Name and assembly of the first recording that the script compares."""
    return next((name, assembly) for name, assembly in command.sessions(DATA) if name == f"`{RECORDINGS[0]}`")
