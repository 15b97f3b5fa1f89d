"""Headline, list and notes say what the audit says; the world is drawn as it was."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.small_tables import made

from cdcore import TriangleMesh
from cdcore.transforms.rigid import rotation_from_quaternion
from replay.comparison.clusters import MANY, clusters
from replay.comparison.outcome import Miss, Outcome
from replay.outputs.palette import MISSED, PARTLY_MISSED
from replay.outputs.rerun_log.columns import packed
from replay.outputs.rerun_log.focus import moments, read_misses
from replay.outputs.rerun_log.markdown import markdown
from replay.outputs.rerun_log.report import report_text
from replay.outputs.rerun_log.world import body_path, shaded
from replay.pipeline.headline import invented
from replay.pipeline.run_result import RunResult

SUBJECT = "22.5Hz"


def test_the_list_has_each_miss_at_its_deepest_frame(demo: RunResult, read: Any) -> None:
    rows = read.column("report/missed", "TextLog:text")
    listed = {int(row[2][0].split()[0]): row for row in rows}
    assert sorted(listed) == [miss.number for miss in demo.misses[SUBJECT]]
    for miss in demo.misses[SUBJECT]:
        row = listed[miss.number]
        words = row[2][0].split()
        assert row[1] == miss.deepest
        assert f"{miss.body_a}-{miss.body_b}" in words
        assert miss.kind in row[2][0]


def test_whole_misses_are_red_and_partial_ones_paler(demo: RunResult, read: Any) -> None:
    words = [row[2][0] for row in read.column("report/missed", "TextLog:text")]
    colours = [row[2][0] for row in read.column("report/missed", "TextLog:color")]
    whole, part = packed([MISSED, PARTLY_MISSED]).tolist()
    assert colours == [whole if "never found" in word else part for word in words]
    assert {whole, part} == set(colours)


def test_the_note_where_the_cursor_meets_a_miss_is_about_that_miss(demo: RunResult, read: Any, recording: Path) -> None:
    count = len(demo.misses[SUBJECT])
    places = {place.number: place.session_ns for place in read_misses(recording)}
    for miss in demo.misses[SUBJECT]:
        text = read.at_ns("report/nearest_miss", "TextDocument:text", places[miss.number])[0]
        assert f"Miss {miss.number} of {count}: {miss.body_a}-{miss.body_b}" in text
        assert f"--miss {miss.number}`" in text


def test_the_report_gives_the_counts_of_the_comparison(demo: RunResult, read: Any) -> None:
    text = read.column("report", "TextDocument:text")[0][2][0]
    assert text == report_text(demo)
    assert all(line in text for line in invented(demo)) and len(invented(demo)) == 1
    comparison = demo.comparisons[SUBJECT]
    assert f"| {comparison.count(Outcome.BOTH):,} | {comparison.count(Outcome.MISSED):,} |" in text
    assert "Exact about the recorded poses" in text
    assert "rod-hand" in text


def test_the_longest_cuts_come_first(demo: RunResult, read: Any) -> None:
    text = read.column("report/longest_cuts", "TextDocument:text")[0][2][0]
    numbers = [int(line.split("**")[1]) for line in text.splitlines() if line.startswith("| **")]
    cuts: dict[int, Miss] = {miss.number: miss for miss in demo.misses[SUBJECT]}
    lengths = [cuts[number].cut_length for number in numbers]
    assert lengths == sorted(lengths, reverse=True)
    assert len(numbers) == min(40, len(cuts))


def test_a_run_that_missed_nothing_says_so(demo: RunResult, write: Any) -> None:
    seen = write(replace(demo, misses={SUBJECT: ()}))
    assert seen.column("report/missed", "TextLog:text")[0][2] == ["nothing missed by 22.5Hz"]


def test_a_miss_between_frames_says_when_and_which_faces_touch_first(passed: RunResult, passed_read: Any) -> None:
    (miss,) = passed.misses["exact"]
    assert miss.touch is not None
    moment = 10_000_000 * miss.touch.frame + miss.touch.later_ns
    ((ns, frame, words),) = passed_read.column("report/missed", "TextLog:text")
    assert (ns, frame) == (moment, 1) and "between frames" in words[0] and "0.01 s" in words[0]
    note = passed_read.at_ns("report/nearest_miss", "TextDocument:text", moment)[0]
    assert "between frames 1 and 2, from 0.01333" in note and "no frame shows it" in note
    assert f"first faces {miss.touch.faces[0]} of a and {miss.touch.faces[1]} of b" in note
    text = passed_read.column("report/longest_cuts", "TextDocument:text")[0][2][0]
    assert text.lstrip().startswith("### 1 missed between frames"), text
    assert text.splitlines()[4].endswith("| a - b | never found | 1 |") and "cut mm" not in text


def test_hundreds_of_misses_are_a_line_per_cluster_at_its_deepest_moment(hundreds: tuple[RunResult, Any]) -> None:
    result, read = hundreds
    misses = result.misses[SUBJECT]
    assert len(misses) > 2 * MANY
    rows = read.column("report/clusters", "TextLog:text")
    assert 1 < len(rows) <= MANY and sum(int(row[2][0].split()[0]) for row in rows) == len(misses)
    at, found = moments(misses), {cluster.deepest.number: cluster for cluster in clusters(misses)}
    for _, frame, words in rows:
        number = int(words[0].rpartition("(miss ")[2].rstrip(")"))
        assert frame == at[number][0] and f"{len(found[number].misses)} x" in words[0]
    assert len(read.column("report/missed", "TextLog:text")) == len(misses), "and every miss keeps its line"


def test_the_words_beside_hundreds_begin_with_the_clusters_deepest_first(hundreds: tuple[RunResult, Any]) -> None:
    result, read = hundreds
    text = read.column("report/longest_cuts", "TextDocument:text")[0][2][0]
    clusters_, longest = text.split("### The ")
    assert f"### {len(result.misses[SUBJECT])} misses of {SUBJECT} in" in clusters_ and longest.startswith(
        f"{MANY} longest cuts"
    )
    cuts = [float(line.split("|")[-2]) for line in clusters_.splitlines() if "**" in line]
    assert len(cuts) > 1 and cuts == sorted(cuts, reverse=True)


def test_markdown_escapes_what_would_end_a_cell():
    assert markdown(made(), level=2).splitlines() == [
        "## a title", "", "| body | count | mark |", "|---|---|---|", "| cup\\|lid | 1,234 | **7** |",
        "| rod | 0 | `x` |", "", "a note",
    ]  # fmt: skip


def test_poses_read_back_are_those_of_the_motion_at_every_frame(demo: RunResult, read: Any) -> None:
    motion = demo.assembly.motion
    for column, body in enumerate(demo.assembly.bodies):
        places = read.column(body_path(body.name), "Transform3D:translation")
        turns = read.column(body_path(body.name), "Transform3D:quaternion")
        frames = [row[1] for row in places]
        latest = np.searchsorted(frames, np.arange(len(motion)), side="right") - 1
        shown = np.array([row[2][0] for row in places])[latest]
        valid = motion.valid[:, column]
        assert np.allclose(shown[valid], motion.translations[valid, column], atol=1e-6)
        matrix = rotation_from_quaternion(np.array([row[2][0] for row in turns]))[latest]
        assert np.allclose(matrix[valid], motion.rotations[valid, column], atol=1e-6)


def test_a_body_that_stands_still_has_one_row(read: Any) -> None:
    assert len(read.column("world/beaker", "Transform3D:translation")) == 1
    assert len(read.column("world/rod", "Transform3D:translation")) == 270


def test_rows_are_stamped_to_the_nanosecond(demo: RunResult, read: Any) -> None:
    rows = read.column("world/rod", "Transform3D:translation")
    assert [row[0] for row in rows] == (demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]).tolist()


def test_a_body_without_a_pose_is_not_drawn(demo: RunResult, read: Any) -> None:
    lost = np.flatnonzero(~demo.assembly.motion.valid[:, 3])
    rows = read.column("world/hand/mesh", "Mesh3D:albedo_factor")
    assert [row[1] for row in rows] == [0, lost[0], lost[-1] + 1]
    assert [row[2][0] & 0xFF for row in rows] == [40, 0, 40]
    assert all(row[1] not in lost for row in read.column("world/hand", "Transform3D:translation"))


def test_glass_is_translucent_in_the_file(read: Any) -> None:
    assert read.column("world/beaker/mesh", "Mesh3D:albedo_factor")[0][2][0] & 0xFF == 34
    assert read.column("world/bench/mesh", "Mesh3D:albedo_factor")[0][2][0] & 0xFF == 255


def cube() -> TriangleMesh:
    corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return TriangleMesh(corners, [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))])


def test_a_box_has_flat_sides() -> None:
    vertices, normals, faces = shaded(cube())
    assert len(vertices) == 24
    assert np.allclose(np.abs(normals).max(axis=1), 1.0)
    assert (normals[faces] == normals[faces][:, :1]).all()


def test_a_fine_cylinder_is_smooth_around() -> None:
    angle = np.arange(32) * (2 * np.pi / 32)
    ring = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    faces = [f for k in range(32) for f in ((k, 32 + k, (k + 1) % 32), ((k + 1) % 32, 32 + k, 32 + (k + 1) % 32))]
    vertices, normals, _ = shaded(TriangleMesh(np.concatenate([ring, ring + np.array([0, 1, 0])]), faces))
    assert len(vertices) == 64
    assert (np.abs((normals * vertices * [1, 0, 1]).sum(axis=1)) > np.cos(np.radians(11.25))).all()


def test_drawing_keeps_every_face_and_its_corners() -> None:
    mesh = cube()
    vertices, _, faces = shaded(mesh)
    assert np.array_equal(vertices[faces], mesh.triangles.astype(np.float32))


def test_a_face_without_area_is_drawn_without_nan() -> None:
    _, normals, _ = shaded(TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]]))
    assert np.isfinite(normals).all()


def test_at_a_touch_between_frames_the_bodies_stand_where_they_touch_until_the_next_frame(
    passed: RunResult, passed_read: Any
) -> None:
    (miss,) = passed.misses["exact"]
    assert miss.touch is not None
    moment = 10_000_000 * miss.touch.frame + miss.touch.later_ns
    places = [
        passed_read.at_ns("world/b", "Transform3D:translation", ns)[0][0] for ns in (moment - 1, moment, 20_000_000)
    ]
    assert places == pytest.approx([0.06, 0.02, -0.06], abs=1e-4)
    assert len(passed_read.column("world/a", "Transform3D:translation")) == 1, "it does not move, so it has no row"
