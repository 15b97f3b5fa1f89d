from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import STEP_NS, STILL, along_x, cube, unit_cubes_on_x
from trimesh.creation import icosphere

from replay import run
from replay.auditing.contact_depth import TOO_MANY_REASON, contact_depths
from replay.auditing.outcome import Episode
from replay.cli.main import main
from replay.document.depth import depth_text
from replay.document.gates import Gates
from replay.prepare.assemble import assemble
from replay.show.report.page import report_html
from replay.show.run_tables import miss_table
from sessions import MeshData, Session, write_session

X_OF_OVERLAPPING_CUBES = {"a": [0] * 9, "b": [3, 0.9, 0.8, 0.7, 0.9, 3, 3, 0.95, 3]}
"""Unit cubes: they are 0.3 in each other at the worst frame of the first contact, and 0.05 in the second."""


@pytest.fixture(scope="module")
def audited_run():
    """A run of two cubes: ``slow`` samples at 20 Hz, ``exact`` is the reference."""
    return run(unit_cubes_on_x(X_OF_OVERLAPPING_CUBES), detectors="slow=discrete[rate_hz=20],exact", oracle="exact")


def test_contacts_have_depth_and_volume_of_their_worst_frame(audited_run):
    """Cubes with an edge of 1 m, 0.7 and 0.95 m apart at the worst: a slab of 0.3 m3 is common, then one of 0.05 m3."""
    rows = audited_run.tables["episodes"].where(detector="exact").plain()
    assert [row["depth"] for row in rows] == pytest.approx([0.3, 0.05])
    assert [row["common_volume"] for row in rows] == pytest.approx([0.3, 0.05])
    assert [row["deepest"] for row in rows] == [3, 7]
    assert {row["depth_unknown"] for row in rows} == {""}


def test_depth_of_a_miss_is_its_deepest_frame(audited_run):
    """Unit cubes at distance d overlap by 1 - d."""
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
    """Cube b lacks its last two faces: no depth is known, while the curve of the faces (``metres``) is."""
    session, whole = unit_cubes_on_x(X_OF_OVERLAPPING_CUBES), cube()
    session = replace(session, meshes=session.meshes | {"b": MeshData(whole.vertices, whole.faces[:-2])})
    result = run(session, detectors="slow=discrete[rate_hz=20],exact", oracle="exact")
    misses = result.misses["slow"]
    assert misses and all(np.isnan(miss.depth) and miss.not_measured == "b is open" for miss in misses)
    assert all(miss.metres > 0 for miss in misses)
    (sentence,) = Gates(max_missed_depth=1.0).broken_limits(result.document.audit, [])
    assert "the depth of misses of slow is unknown: b is open" in sentence


@pytest.mark.parametrize(("limit", "code"), [("1mm", 4), ("0.4 m", 0), ("3", 2), ("-1mm", 2)])
def test_gate_on_the_command_line_takes_a_length(limit, code, tmp_path, capsys):
    """Misses are up to 0.3 m deep: over 1 mm (exit code 4) and under 0.4 m (0); 3 has no unit and -1 mm is no depth."""
    write_session(unit_cubes_on_x(X_OF_OVERLAPPING_CUBES), tmp_path / "s.mcap")
    command = ["run", str(tmp_path / "s.mcap"), "-o", str(tmp_path / "out"), "--no-picture", "--fix-time", "0"]
    assert main([*command, "--detectors", "slow=discrete[rate_hz=20]", f"--max-missed-depth={limit}"]) == code
    capsys.readouterr()


def session_with_deep_frame(frames, at, shallow, deep):
    """Cubes in contact so deep in all frames but one, where they are deeper; apart before and after."""
    depths = np.full(frames, shallow)
    depths[at] = deep
    return unit_cubes_on_x({"a": [0.0] * (frames + 4), "b": [3, 3, *(1 - depths).tolist(), 3, 3]})


@pytest.mark.parametrize("at", [18, *(pytest.param(frame, marks=pytest.mark.slow) for frame in (1, 59))])
def test_single_deep_frame_of_a_long_contact_is_found(at):
    """Contact begins in frame 2, so that its frame ``at`` is frame ``at + 2``; ``slow`` samples too late to see it."""
    result = run(
        session_with_deep_frame(frames=60, at=at, shallow=0.1, deep=0.35),
        detectors="slow=discrete[rate_hz=0.2,sampling_offset_s=10]",
        oracle="exact",
    )
    (row,) = result.tables["episodes"].where(detector="exact").plain()
    assert (row["deepest"], row["depth_at_least"]) == (at + 2, False)
    assert row["depth"] == pytest.approx(0.35)
    (miss,) = result.misses["slow"]
    assert (miss.depth, miss.depth_at_least) == (pytest.approx(0.35), False)
    series = result.depth_series[0]
    assert series.keys() <= set(range(2, 62)) and max(series, key=series.__getitem__) == at + 2


def test_round_body_is_deepest_where_its_path_comes_nearest():
    """Balls of a diameter of 1 m come to 0.8 m of each other in frame 32: 0.2 m deep."""
    ball, path = icosphere(subdivisions=3, radius=0.5), 1.0 - 0.2 * np.exp(-(((np.arange(50) - 31.0) / 4.0) ** 2))
    poses = {"a": along_x(np.zeros(52)), "b": along_x([3, *path.tolist(), 3])}
    meshes = {name: MeshData(np.asarray(ball.vertices), np.asarray(ball.faces)) for name in poses}
    session = Session.from_arrays(np.arange(52) * 10_000_000, poses, meshes)
    result = run(session, detectors="exact,mesh=discrete", oracle="exact")
    deepest = max(result.depths, key=lambda depth: depth.depth)
    assert abs(deepest.frame - 32) <= 1 and deepest.depth == pytest.approx(0.2, rel=0.03)


def test_very_shallow_contact_is_measured():
    """Cubes are 10 micrometres deep in each other, 40 in one frame: a depth between the two is accepted."""
    result = run(
        session_with_deep_frame(frames=30, at=17, shallow=1e-5, deep=4e-5),
        detectors="exact,mesh=discrete",
        oracle="exact",
    )
    assert 1e-5 * 0.999 <= result.depths[0].depth <= 4e-5 * 1.001


def test_depth_is_at_least_where_frames_were_left_out(monkeypatch):
    """Only 20 of the 60 frames are searched: the one that is 0.35 m deep may be left out, 0.1 m is certain."""
    monkeypatch.setattr("replay.auditing.contact_depth.FRAMES_SEARCHED", 20)
    result = run(
        session_with_deep_frame(frames=60, at=7, shallow=0.1, deep=0.35),
        detectors="slow=discrete[rate_hz=0.2,sampling_offset_s=10]",
        oracle="exact",
    )
    (miss,) = result.misses["slow"]
    assert miss.depth_at_least and miss.depth * 1.001 >= 0.1
    assert miss_table(result, "slow").notes == ("At least so deep: not every frame of a miss was searched.",)
    (sentence,) = Gates(max_missed_depth=1.0).broken_limits(result.document.audit, [])
    assert "cannot be checked: not every frame of 1 miss of slow was searched" in sentence
    assert "at least" in report_html(result)


@pytest.mark.parametrize(("metres", "noise"), [(0.0006, True), (0.0009, False)])
def test_shallow_miss_is_said_to_be_possible_tracker_noise(metres, noise):
    """Noise of a tracker makes contacts of up to three standard deviations of 0.24 mm, 0.73 mm.

    A detector that first looks after 10 s misses the only contact; with ``tau=0`` no contact is excused as shallow.
    """
    session = session_with_deep_frame(frames=12, at=5, shallow=metres, deep=metres)
    result = run(session, detectors="slow=discrete[rate_hz=0.2,sampling_offset_s=10]", oracle="exact", tau=0.0)
    (miss,) = result.misses["slow"]
    said = f"It is {1e3 * metres:g} mm deep: the noise of a tracker could have made it." in miss.why
    assert said == noise
    text = f"{1e3 * metres:g} mm deep{', as tracker noise could make' if noise else ''}"
    assert depth_text(miss.depth) == text
    assert f'"{text}"' in report_html(result).replace("&#34;", '"').replace("&quot;", '"')


def test_rotation_and_path_of_the_origin_add_to_depth():
    """A cube 10 m from its body's origin: half of its way comes of the rotation, half of the path of the origin."""
    depths, reach = np.array([0.1, 0.12, 0.35, 0.12, 0.2]), np.array([10.0, 0.0, 0.0])
    angles, origin_of_b = np.arcsin((depths[0] - depths) / 20.0), np.array([1.0, 2.0, 3.0])
    arcs = 10.0 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    origins = np.array([0.0, 1.0 - depths[0], 0.0]) - reach + arcs - reach
    quaternions = np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], axis=1)
    poses = {"a": (origin_of_b + origins, quaternions), "b": (np.tile(origin_of_b, (5, 1)), np.tile(STILL, (5, 1)))}
    meshes = {"a": MeshData(cube().vertices + reach, cube().faces), "b": cube()}
    assembly = assemble(Session.from_arrays(np.arange(5) * STEP_NS, poses, meshes))
    (depth,) = contact_depths(assembly, [Episode(pair=0, first=0, last=4, start=0.0, end=0.05)], {}).contacts
    # The rotation of the cube about its own middle, 0.7 degrees, makes it deeper by at most 0.5 * sin(angle).
    assert depth.frame == 2 and 0.35 <= depth.depth <= 0.35 + 0.5 * np.sin(np.abs(angles).max())


def test_of_too_many_contacts_the_longest_are_measured(monkeypatch):
    """A contact of frame 1 and one of frames 3 to 6, 0.3 deep; only one may be measured."""
    monkeypatch.setattr("replay.auditing.contact_depth.MOST_MEASURED_CONTACTS", 1)
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 8, "b": [3, 0.95, 3, 0.9, 0.8, 0.7, 0.9, 3]}))
    short, long = Episode(pair=0, first=1, last=1, start=0.0, end=0.01), Episode(0, first=3, last=6, start=0.0, end=0.1)
    tap, contact = contact_depths(assembly, [short, long], {}).contacts
    assert (tap.is_measured, tap.frame, tap.reason) == (False, 1, TOO_MANY_REASON)
    assert contact.is_measured and contact.depth == pytest.approx(0.3)


@pytest.mark.parametrize(("most_frames", "at_least"), [(5, True), (6, False)])
def test_depth_is_at_least_where_a_frame_is_omitted(monkeypatch, most_frames, at_least):
    """A contact of six frames, of which five may be searched, or all."""
    monkeypatch.setattr("replay.auditing.contact_depth.FRAMES_SEARCHED", most_frames)
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 6, "b": [0.7, 0.9, 0.9, 0.9, 0.9, 0.9]}))
    (depth,) = contact_depths(assembly, [Episode(pair=0, first=0, last=5, start=0.0, end=0.06)], {}).contacts
    assert depth.at_least == at_least and depth.depth == pytest.approx(0.3)


def test_frames_that_cannot_be_deepest_are_not_searched():
    """A cube is 0.3 deep in frame 0, then rests at 0.1: of the frames at rest the last alone is searched."""
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 6, "b": [0.7, 0.9, 0.9, 0.9, 0.9, 0.9]}))
    assert contact_depths(assembly, [Episode(pair=0, first=0, last=5, start=0.0, end=0.06)], {}).series[0].keys() == {
        0,
        5,
    }
