"""The solid of a collider is drawn by its edges, while a contact of it is false or its pair is in focus."""

import numpy as np
import pytest
from support.shapes import box_mesh

from replay.comparison.outcome import Outcome
from replay.outputs.moments import key_moments, pair_in_focus
from replay.outputs.palette import INVENTED
from replay.outputs.rerun_log import solids
from replay.outputs.rerun_log.columns import packed
from replay.outputs.rerun_log.solids import sharp_edges, with_solids

LABEL = "hull"


@pytest.fixture(scope="module")
def run(taps):
    return taps(135, LABEL, "collider", shape="hull")


@pytest.fixture(scope="module")
def seen(run, tmp_path_factory, reader):
    from replay.outputs.rerun_log.recording import write_recording

    path = tmp_path_factory.mktemp("solids") / "run.rrd"
    write_recording(run, path)
    return reader(path)


def test_a_box_has_twelve_edges_and_none_across_its_sides():
    edges = sharp_edges(box_mesh((1.0, 2.0, 3.0)))
    assert sorted(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).round(9)) == [1.0] * 4 + [2.0] * 4 + [3.0] * 4


def test_edges_are_those_of_the_solid_that_decided_and_stand_while_it_is_false(run, seen):
    outcome, assembly = run.comparisons[LABEL].outcome, run.assembly
    pair = pair_in_focus(key_moments(run), len(outcome))
    beaker = assembly.names.index("beaker")
    false = (outcome[:, [0]] == Outcome.INVENTED).any(axis=1)
    assert false.any() and not false.all()
    edges = sharp_edges(run.detectors[LABEL].colliders[beaker].mesh)
    for frame in range(len(outcome)):
        strips = seen.at(f"world/beaker/solid_of_{LABEL}", "LineStrips3D:strips", frame)
        focus = beaker in assembly.pairs[pair[frame]]
        assert len(strips) == (len(edges) if false[frame] or focus else 0), frame
        if len(strips):
            assert np.allclose(strips, edges, atol=1e-6)
            colours = seen.at(f"world/beaker/solid_of_{LABEL}", "LineStrips3D:colors", frame)
            assert (colours[0] == packed([INVENTED])[0]) == false[frame]


@pytest.mark.parametrize("shape", ["box", "sphere", "capsule"])
def test_a_solid_of_every_shape_is_drawn_as_it_decided(taps, write, shape):
    run = taps(30, shape, "collider", shape=shape)
    seen, names = write(run), run.assembly.names
    pair = pair_in_focus(key_moments(run), len(run.assembly.motion))
    for body in run.assembly.pairs[pair[5]].tolist():
        (part,) = run.detectors[shape].parts[names[body]]
        drawn = seen.at(f"world/{names[body]}/solid_of_{shape}", "LineStrips3D:strips", 5)
        assert np.ptp(part.vertices, axis=0).max() / 2 > solids.ROOM or len(drawn) == len(sharp_edges(part)) > 0


def test_of_a_compound_every_piece_is_drawn(run, write, monkeypatch):
    half = box_mesh((0.01, 0.02, 0.03))
    parts = dict.fromkeys(run.assembly.names, (half, half))
    monkeypatch.setattr(run.detectors[LABEL], "parts", parts)
    seen, frames = write(run), range(0, len(run.assembly.motion), 10)
    drawn = {len(seen.at(f"world/rod/solid_of_{LABEL}", "LineStrips3D:strips", frame)) for frame in frames}
    assert max(drawn) == 2 * len(sharp_edges(half)) == 24


def test_a_detector_on_meshes_has_no_solids(demo, taps):
    assert with_solids(demo) == [] == with_solids(taps(135, "mesh", "collider", shape="mesh"))


def test_of_too_many_stretches_the_longest_are_drawn(run, write, monkeypatch):
    monkeypatch.setattr(solids, "DRAWN_EDGES", 500)
    kept = write(run)
    rows = [
        values for path in kept.entities if "solid_of" in path
        for _, _, values in kept.column(path.removeprefix("/"), "LineStrips3D:strips")
    ]  # fmt: skip
    assert 0 < sum(map(len, rows)) <= 500
