"""The answer: a click on any moment leads before it, and what is said there has the figures of the tables."""

from dataclasses import replace

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb
from support.shapes import box_mesh

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.narrow.mesh_stage import MeshStage
from replay.errors import RunFolderError
from replay.outputs.camera import CLOSE_UP
from replay.outputs.palette import FREE, INVENTED
from replay.outputs.rerun_log.close_up import close_ups, sharp_edges
from replay.outputs.rerun_log.moments import FALSE, MISS, key_moments, list_path, read_moments
from replay.outputs.rerun_log.recording_file import packed, recording_file
from replay.outputs.rerun_log.viewer import _target

SUBJECT, HULL = "22.5Hz", "hull"


@pytest.fixture(scope="module")
def moments(demo):
    return key_moments(demo)


@pytest.fixture(scope="module")
def hulls(taps, drawn):
    """A run of hulls, and its picture."""
    run = taps(135, HULL, "collider", shape="hull")
    return run, drawn(run)


def at(run, moment):
    return int(run.assembly.stamp_ns[moment.frame] - run.assembly.stamp_ns[0]) + moment.later


def test_the_moments_are_all_misses_and_false_contacts_and_no_two_share_a_place(demo, moments):
    faults = {(one.kind, one.number) for one in moments if one.label}
    missed = {(MISS, one.number) for one in demo.misses[SUBJECT]}
    assert faults == missed | {(FALSE, one.number) for one in demo.false[SUBJECT]}
    assert len({(one.frame, one.later) for one in moments}) == len(moments)


def test_where_the_list_leads_the_eye_looks_at_the_moment_and_words_name_it(demo, moments, read):
    assert sum(len(read.column(list_path(by), "TextLog:text")) for by in (SUBJECT, "")) == len(moments)
    for one in moments:
        ns = at(demo, one)
        (line,) = read.at_ns(list_path(one.label), "TextLog:text", ns)
        assert line.startswith(one.label) and demo.assembly.pair_name(one.pair) in line
        if one.kind == MISS:
            (place,) = read.at_ns("world/focus/eye", "Transform3D:translation", ns)
            assert np.linalg.norm(np.subtract(place, one.point)) == pytest.approx(CLOSE_UP, abs=1e-4)
        if one.label:
            (words,) = read.at_ns("world/focus/words", "Points3D:labels", ns)
            assert words.startswith(one.label) or words.endswith(("mm", "cm", "apart"))
    pins = read.column("world/focus/pins", "Points3D:positions")[0][2]
    assert np.allclose(sorted(pins), sorted(one.point for one in moments if one.label), atol=1e-6)


def test_a_false_contact_shows_the_gap_the_white_body_and_the_cage_and_each_only_while_it_lasts(hulls):
    run, seen = hulls
    balls = [sphere_best(body.mesh) for body in run.assembly.bodies]
    views, names = close_ups(run, key_moments(run), balls), run.assembly.names
    false = [one for one in views if one.label == HULL and one.kind == FALSE]
    meshes = MeshStage(run.assembly.bodies, run.assembly.pairs)
    assert any(views[one].free is not None for one in false)
    for one in false:
        ns = at(run, one)
        gap = meshes.gap(run.assembly.motion, one.frame, one.pair)[0]
        assert np.linalg.norm(np.diff(views[one].ends, axis=0)) == pytest.approx(gap) == one.size
        (words,) = seen.at_ns("world/focus/words", "Points3D:labels", ns)
        assert words.endswith(f"{1e3 * gap:.{0 if gap >= 0.00995 else 1}f} mm") or f"{1e3 * gap:.1f} mm" in words
        for body in views[one].caged:
            edges = sharp_edges(run.detectors[HULL].colliders[body].mesh)
            drawn = seen.at_ns(f"world/{names[body]}/solid_of_{HULL}", "LineStrips3D:strips", ns)
            assert np.allclose(drawn, edges, atol=1e-6)
        if views[one].free is not None:
            (colour,) = seen.at_ns(f"world/{names[views[one].free]}/mesh", "Mesh3D:albedo_factor", ns)
            assert colour == packed([FREE])[0]
    beaker = names.index("beaker")
    lasts = np.zeros(len(run.assembly.motion), dtype=bool)
    for one in false:
        lasts[one.first : one.last + 1] |= beaker in views[one].caged
    strips = [seen.at(f"world/beaker/solid_of_{HULL}", "LineStrips3D:strips", k) for k in range(len(lasts))]
    assert not any(strips[k] for k in np.flatnonzero(~lasts)) and not lasts.all()
    colours = seen.column(f"world/beaker/solid_of_{HULL}", "LineStrips3D:colors")
    assert colours[0][2] == packed([INVENTED]).tolist()


def test_a_box_has_twelve_edges_and_none_across_its_sides():
    edges = sharp_edges(box_mesh((1.0, 2.0, 3.0)))
    assert sorted(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).round(9)) == [1.0] * 4 + [2.0] * 4 + [3.0] * 4


def test_a_number_leads_to_its_moment_and_a_wrong_one_is_one_sentence(demo, moments, recording):
    there = sorted((one.kind, one.number) for one in read_moments(recording))
    assert there == sorted((one.kind, one.number) for one in moments)
    for one in moments:
        if one.kind == FALSE:
            assert (
                _target(recording, None, one.number, "")
                == _target(recording, None, one.number, SUBJECT)
                == at(demo, one)
            )
        elif one.kind == MISS:
            assert _target(recording, one.number, None, SUBJECT) == at(demo, one)
    with pytest.raises(RunFolderError, match=r"there is no false 999 in .*; its false contacts are numbered 1 to \d+"):
        _target(recording, None, 999, "")
    with pytest.raises(RunFolderError, match=r"there is no miss 1 in .*; it has none"):
        _target(recording, 1, None, "nobody")


@pytest.mark.parametrize("content", [b"", b"not a recording"])
def test_a_file_that_is_no_recording_is_one_sentence(tmp_path, content):
    (tmp_path / "run.rrd").write_bytes(content)
    with pytest.raises(RunFolderError, match=r"run\.rrd cannot be read as a recording"):
        read_moments(tmp_path / "run.rrd")


def test_a_picture_of_an_earlier_version_is_one_sentence_and_not_said_to_be_without_moments(tmp_path):
    with recording_file("test", tmp_path / "run.rrd", rrb.Blueprint(rrb.Spatial3DView(origin="/"))) as stream:
        stream.log("moments/table", rr.AnyValues(label=["slow"], kind=["miss"], number=[1]), static=True)
    with pytest.raises(RunFolderError, match="earlier version; replay the session again"):
        _target(tmp_path / "run.rrd", 1, None, "")


def test_a_miss_between_frames_is_listed_at_the_moment_of_the_touch(passed, passed_read):
    (miss,) = passed.misses["exact"]
    moment = 10_000_000 * miss.touch.frame + miss.touch.later_ns
    ((ns, frame, words),) = passed_read.column(list_path("exact"), "TextLog:text")
    assert (ns, frame) == (moment, 1) and words[0].startswith("exact")
    assert passed_read.at_ns("world/focus/words", "Points3D:labels", moment) == ["exact misses this contact"]


def test_letters_that_the_font_of_the_viewer_lacks_are_written_as_numbers(demo, drawn):
    scene = replace(demo.session.scene, name="手 at the bench")
    bodies = tuple(replace(one, name="手") if one.name == "rod" else one for one in demo.assembly.bodies)
    run = replace(demo, session=replace(demo.session, scene=scene), assembly=replace(demo.assembly, bodies=bodies))
    from support.sentences import recording_text

    seen = drawn(run)
    assert "/world/u624b" in seen.entities and not [path for path in seen.entities if "手" in path]
    words = recording_text(seen.path)
    assert "u624b at the bench" in words and "手" not in words and "beaker-u624b" in words
