import html
from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import STEP_NS, STILL, along_x, cube, unit_cubes_on_x
from trimesh.creation import icosphere

from replay import run
from replay.auditing.contact_depth import TOO_MANY_REASON, contact_depths
from replay.auditing.outcome import Episode
from replay.cli.console import EXIT_GATE_FAILED, EXIT_OK
from replay.cli.main import main
from replay.document.depth import depth_text
from replay.document.gates import Gates
from replay.prepare.assemble import assemble
from replay.show.report.page import report_html
from replay.show.run_tables import miss_table
from sessions import MeshData, Session, write_session

USAGE_ERROR = 2
"""Exit code of click for an option's value that cannot be read."""

X_OF_OVERLAPPING_CUBES = {"a": [0] * 9, "b": [3, 0.9, 0.8, 0.7, 0.9, 3, 3, 0.95, 3]}
"""Metres, frame by frame: unit cubes at a distance d < 1 overlap by 1 - d.

Their first contact, frames 1 to 4, is 0.3 m deep in frame 3; the second, frame 7, is 0.05 m deep.
"""


@pytest.fixture(scope="module")
def audited_run():
    """A run of these cubes in frames of 10 ms; ``slow`` samples every fifth frame, ``exact`` is the reference."""
    return run(unit_cubes_on_x(X_OF_OVERLAPPING_CUBES), detectors="slow=discrete[rate_hz=20],exact", oracle="exact")


def test_contacts_have_depth_and_volume_of_their_worst_frame(audited_run):
    """Cubes of 1 m, 0.7 and 0.95 m apart at the worst, have a slab in common of 0.3 m x 1 m x 1 m, then of 0.05 m."""
    rows = audited_run.tables["episodes"].where(detector="exact").plain()
    assert [row["depth"] for row in rows] == pytest.approx([0.3, 0.05])
    assert [row["common_volume"] for row in rows] == pytest.approx([0.3, 0.05])
    assert [row["deepest"] for row in rows] == [3, 7], "frames"
    assert {row["depth_unknown"] for row in rows} == {""}, "no reason, since both depths are known"


def test_depth_of_a_miss_is_its_deepest_frame(audited_run):
    """Unit cubes at distance d overlap by 1 - d; samples at 20 Hz miss their contacts.

    A miss is as deep as the deepest of its frames, and the audit's figure for all misses is that of the deepest miss.
    """
    for miss in audited_run.misses["slow"]:
        overlaps = [1 - X_OF_OVERLAPPING_CUBES["b"][frame] for frame in range(miss.first, miss.last + 1)]
        assert miss.depth == pytest.approx(max(overlaps))
    deepest = max(miss.depth for miss in audited_run.misses["slow"])
    assert audited_run.document.audit["slow"].missed_depth.deepest == deepest


def test_gate_refuses_misses_that_are_deeper(audited_run):
    """The limit is 0.1 % above the deepest miss, which passes, and 0.1 % below it."""
    audit = audited_run.document.audit
    deepest = audit["slow"].missed_depth.deepest
    assert Gates(max_missed_depth=deepest * 1.001).broken_limits(audit, []) == []
    (sentence,) = Gates(max_missed_depth=deepest * 0.999).broken_limits(audit, [])
    assert sentence.startswith(f"slow missed contact that is {1e3 * deepest:g} mm deep, more than --max-missed-depth")


def test_open_bodies_make_the_gate_fail_with_the_reason():
    """Cube b lacks its last two faces, so its misses have no depth; the curve where faces cross still has a length.

    A limit on the depth of misses, here 1 m, cannot be checked and fails, with the reason.
    """
    session, whole = unit_cubes_on_x(X_OF_OVERLAPPING_CUBES), cube()
    session = replace(session, meshes=session.meshes | {"b": MeshData(whole.vertices, whole.faces[:-2])})
    result = run(session, detectors="slow=discrete[rate_hz=20],exact", oracle="exact")
    misses = result.misses["slow"]
    assert misses and all(np.isnan(miss.depth) and miss.not_measured == "b is open" for miss in misses)
    assert all(miss.metres > 0 for miss in misses), "metres of the curve"
    (sentence,) = Gates(max_missed_depth=1.0).broken_limits(result.document.audit, [])
    assert "the depth of misses of slow is unknown: b is open" in sentence


@pytest.mark.parametrize(
    ("limit", "code", "sentence"),
    [
        pytest.param("1mm", EXIT_GATE_FAILED, "deep, more than --max-missed-depth 1 mm", id="less than the depth"),
        pytest.param("0.4 m", EXIT_OK, "", id="more than the depth"),
        pytest.param("3", USAGE_ERROR, "'3' is no length; write it with its unit", id="no unit"),
        pytest.param("-1mm", USAGE_ERROR, "'-1mm' is no length", id="negative"),
    ],
)
def test_gate_on_the_command_line_takes_a_length(limit, code, sentence, tmp_path, capsys):
    """A detector of 20 Hz misses contact that is up to 0.3 m deep; ``limit`` is the depth that misses may have.

    ``code``: the exit code of the command. The gate fails where a miss is deeper than the limit.
    """
    write_session(unit_cubes_on_x(X_OF_OVERLAPPING_CUBES), tmp_path / "s.mcap")
    command = ["run", str(tmp_path / "s.mcap"), "--no-picture", "--fix-time", "0"]
    assert main([*command, "--detectors", "slow=discrete[rate_hz=20]", f"--max-missed-depth={limit}"]) == code
    assert sentence in " ".join(capsys.readouterr().err.split())


SEES_NOTHING_FOR_10_S = "slow=discrete[rate_hz=0.2,sampling_offset_s=10]"
"""A detector that samples for the first time 10 s after the first frame: it misses all of a shorter recording."""


def session_with_deep_frame(frames, at, shallow, deep):
    """Unit cubes in contact for so many frames, from frame 2 on; apart in the two frames before and after.

    They are ``shallow`` metres in each other, ``deep`` in frame ``at`` of the contact: frame ``at + 2`` of all.
    """
    depths = np.full(frames, shallow)
    depths[at] = deep
    return unit_cubes_on_x({"a": [0.0] * (frames + 4), "b": [3, 3, *(1 - depths).tolist(), 3, 3]})


@pytest.mark.parametrize("at", [18, *(pytest.param(frame, marks=pytest.mark.slow) for frame in (1, 59))])
def test_single_deep_frame_of_a_long_contact_is_found(at):
    """Contact is in frames 2 to 61, 0.1 m deep, and 0.35 m in frame ``at + 2``, which contact, miss and series have.

    ``depth_at_least`` false: every frame that could be the deepest was searched.
    """
    session = session_with_deep_frame(frames=60, at=at, shallow=0.1, deep=0.35)
    result = run(session, detectors=SEES_NOTHING_FOR_10_S, oracle="exact")
    (row,) = result.tables["episodes"].where(detector="exact").plain()
    assert (row["deepest"], row["depth_at_least"]) == (at + 2, False)
    assert row["depth"] == pytest.approx(0.35)
    (miss,) = result.misses["slow"]
    assert (miss.depth, miss.depth_at_least) == (pytest.approx(0.35), False)
    depth_by_frame = result.depth_series[0]
    assert depth_by_frame.keys() <= set(range(2, 62))
    assert max(depth_by_frame, key=depth_by_frame.__getitem__) == at + 2


def test_round_body_is_deepest_where_its_path_comes_nearest():
    """Balls of radius 0.5 m come from a distance of 1 m to 0.8 m in frame 32 and part again: 0.2 m deep there.

    They are icospheres, whose faces lie up to 2.3 mm within the sphere: 3 % of the depth, 6 mm, is allowed.
    """
    ball, nearest_frame = icosphere(subdivisions=3, radius=0.5), 32
    distances = 1.0 - 0.2 * np.exp(-(((np.arange(1, 51) - nearest_frame) / 4.0) ** 2))
    poses = {"a": along_x(np.zeros(52)), "b": along_x([3, *distances.tolist(), 3])}
    meshes = {name: MeshData(np.asarray(ball.vertices), np.asarray(ball.faces)) for name in poses}
    session = Session.from_arrays(np.arange(52) * STEP_NS, poses, meshes)
    result = run(session, detectors="exact,mesh=discrete", oracle="exact")
    deepest = max(result.depths, key=lambda depth: depth.depth)
    assert abs(deepest.frame - nearest_frame) <= 1
    assert deepest.depth == pytest.approx(0.2, rel=0.03)


def test_very_shallow_contact_is_measured():
    """Cubes are 10 micrometres deep in each other, 40 in one frame; the depth is at least 10 and at most 40.

    So shallow a depth is not measured to the frame: this asks only that it is measured, to 0.1 %.
    """
    session = session_with_deep_frame(frames=30, at=17, shallow=10e-6, deep=40e-6)
    result = run(session, detectors="exact,mesh=discrete", oracle="exact")
    assert 10e-6 * 0.999 <= result.depths[0].depth <= 40e-6 * 1.001


def test_depth_is_at_least_where_frames_were_left_out(monkeypatch):
    """Only 20 of 60 frames of contact are searched: the one that is 0.35 m deep may be left out, 0.1 m is certain.

    The table of misses and the report say "at least"; a gate, even of 1 m, fails, since it cannot be checked.
    """
    monkeypatch.setattr("replay.auditing.contact_depth.FRAMES_SEARCHED", 20)
    session = session_with_deep_frame(frames=60, at=7, shallow=0.1, deep=0.35)
    result = run(session, detectors=SEES_NOTHING_FOR_10_S, oracle="exact")
    (miss,) = result.misses["slow"]
    assert miss.depth_at_least and miss.depth >= 0.1 * (1 - 1e-3)
    assert miss_table(result, "slow").notes == ("At least so deep: not every frame of a miss was searched.",)
    assert "at least" in report_html(result)
    (sentence,) = Gates(max_missed_depth=1.0).broken_limits(result.document.audit, [])
    assert "cannot be checked: not every frame of 1 miss of slow was searched" in sentence


@pytest.mark.parametrize(
    ("metres", "noise"), [pytest.param(0.6e-3, True, id="0.6 mm"), pytest.param(0.9e-3, False, id="0.9 mm")]
)
def test_shallow_miss_is_said_to_be_possible_tracker_noise(metres, noise):
    """Noise of a tracker makes contacts of up to three standard deviations of 0.24 mm, 0.73 mm.

    The only contact is missed; with ``tau=0`` no contact is excused as shallow. The miss, its depth and the report say
    whether noise could have made it.
    """
    session = session_with_deep_frame(frames=12, at=5, shallow=metres, deep=metres)
    result = run(session, detectors=SEES_NOTHING_FOR_10_S, oracle="exact", tau=0.0)
    (miss,) = result.misses["slow"]
    sentence = f"It is {1e3 * metres:g} mm deep: the noise of a tracker could have made it."
    assert (sentence in miss.why) == noise
    text = f"{1e3 * metres:g} mm deep{', as tracker noise could make' if noise else ''}"
    assert depth_text(miss.depth) == text
    assert f'"{text}"' in html.unescape(report_html(result))


def test_rotation_and_path_of_the_origin_add_to_depth():
    """Cube a is 10 m from its body's origin: half of its way comes of the rotation, half of the path of the origin.

    It comes along y into cube b: 0.35 m deep in frame 2, and less in the others.
    """
    depths, lever = np.array([0.1, 0.12, 0.35, 0.12, 0.2]), np.array([10.0, 0.0, 0.0])
    # A rotation by ``angle`` moves the cube by 10 m * sin(angle), and the origin moves by as much.
    angles, origin_of_b = np.arcsin((depths[0] - depths) / (2 * 10.0)), np.array([1.0, 2.0, 3.0])
    arcs = 10.0 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    origins_of_a = np.array([0.0, 1.0 - depths[0], 0.0]) - lever + arcs - lever
    quaternions = np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], axis=1)
    poses = {
        "a": (origin_of_b + origins_of_a, quaternions),
        "b": (np.tile(origin_of_b, (5, 1)), np.tile(STILL, (5, 1))),
    }
    meshes = {"a": MeshData(cube().vertices + lever, cube().faces), "b": cube()}
    assembly = assemble(Session.from_arrays(np.arange(5) * STEP_NS, poses, meshes))
    (depth,) = contact_depths(assembly, [Episode(pair=0, first=0, last=4, start=0.0, end=0.05)], {}).contacts
    assert depth.frame == 2
    # The rotation of the cube about its own middle, 0.7 degrees, makes it deeper by at most 0.5 m * sin(angle).
    assert 0.35 <= depth.depth <= 0.35 + 0.5 * np.sin(np.abs(angles).max())


def test_of_too_many_contacts_the_longest_are_measured(monkeypatch):
    """A contact of frame 1 and one of frames 3 to 6, at most 0.3 m deep; only one may be measured."""
    monkeypatch.setattr("replay.auditing.contact_depth.MOST_MEASURED_CONTACTS", 1)
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 8, "b": [3, 0.95, 3, 0.9, 0.8, 0.7, 0.9, 3]}))
    tap = Episode(pair=0, first=1, last=1, start=0.01, end=0.02)
    contact = Episode(pair=0, first=3, last=6, start=0.03, end=0.07)
    short, long = contact_depths(assembly, [tap, contact], {}).contacts
    assert (short.is_measured, short.frame, short.reason) == (False, 1, TOO_MANY_REASON)
    assert long.is_measured and long.depth == pytest.approx(0.3)


def depths_of_six_frames(depths):
    """The depth of a contact of two unit cubes that are so deep in each other, and the depths by frame searched."""
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 6, "b": [1.0 - depth for depth in depths]}))
    result = contact_depths(assembly, [Episode(pair=0, first=0, last=5, start=0.0, end=0.06)], {})
    return result.contacts[0], result.series[0]


@pytest.mark.parametrize(
    ("most_frames", "at_least"), [pytest.param(5, True, id="5 of 6"), pytest.param(6, False, id="all")]
)
def test_depth_is_at_least_where_a_frame_is_omitted(monkeypatch, most_frames, at_least):
    """A contact of six frames, 0.3 m deep in the first and 0.1 m in the others; so many of them may be searched."""
    monkeypatch.setattr("replay.auditing.contact_depth.FRAMES_SEARCHED", most_frames)
    depth, _ = depths_of_six_frames([0.3, 0.1, 0.1, 0.1, 0.1, 0.1])
    assert depth.at_least == at_least and depth.depth == pytest.approx(0.3)


def test_frames_that_cannot_be_deepest_are_not_searched():
    """A cube is 0.3 m deep in frame 0, then rests at 0.1 m: of the frames at rest the last alone is searched.

    No depth changes by more than the bodies move, so the other frames at rest are as deep as the last, not 0.3 m.
    """
    _, depth_by_searched_frame = depths_of_six_frames([0.3, 0.1, 0.1, 0.1, 0.1, 0.1])
    assert depth_by_searched_frame.keys() == {0, 5}
