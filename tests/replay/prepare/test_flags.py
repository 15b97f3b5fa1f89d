import numpy as np
from support.small_worlds import STEP_NS, cubes

from replay.prepare.assemble import assemble
from replay.prepare.flags import FLAG_KINDS, Flags, FlagSpan, flag_word
from sessions import Scene
from sessions.model.scene import SceneBody


def span(kind, body, first, last):
    return FlagSpan(kind, body, first * STEP_NS, last * STEP_NS, 0.0, 0.0, last - first + 1, "keep")


def flags(spans, scene=None, **window):
    scene = scene or Scene()
    session = cubes({"a": range(10), "b": [9] * 10, "c": [4] * 10}, scene=scene)
    assembly = assemble(session, **window)
    return Flags.of(spans, assembly, scene), assembly


def test_a_span_flags_its_body_and_every_pair_of_it():
    found, assembly = flags([span("frozen", "b", 3, 5)])
    bit = 1 << FLAG_KINDS.index("frozen")
    assert found.bodies[:, 1].tolist() == [0] * 3 + [bit] * 3 + [0] * 4
    assert not found.bodies[:, [0, 2]].any()
    names = [assembly.pair_name(column) for column in range(len(assembly.pairs))]
    for name, column in zip(names, found.of_pairs(assembly.pairs, 3, 6).T, strict=True):
        assert (column == (bit if "b" in name else 0)).all()


def test_a_gap_flags_every_body_and_a_window_keeps_its_own_frames():
    found, _ = flags([span("gap", "", 4, 4), span("teleport", "a", 1, 1)], start=2 * STEP_NS / 1e9)
    assert np.flatnonzero(found.bodies.all(axis=1)).tolist() == [2]
    assert found.bodies.shape == (8, 3) and np.count_nonzero(found.bodies) == 3


def test_a_child_carries_the_doubt_about_its_parents():
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b", parent="c"), SceneBody("c")))
    found, _ = flags([span("frozen", "c", 2, 2)], scene)
    assert found.bodies[2].tolist() == [0, found.bodies[2, 2], found.bodies[2, 2]] and found.bodies[2, 2]


def test_a_flag_names_its_kinds():
    assert flag_word(0) == ""
    assert flag_word(1 << FLAG_KINDS.index("frozen") | 1 << FLAG_KINDS.index("gap")) == "frozen+gap"
