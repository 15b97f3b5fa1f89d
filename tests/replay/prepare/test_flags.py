import numpy as np
from support.small_worlds import STEP_NS, unit_cubes_on_x

from replay.prepare.assemble import assemble
from replay.prepare.flags import FLAG_KINDS, Flags, FlagSpan, flag_word
from sessions import Scene
from sessions.model.scene import SceneBody


def test_flag_of_a_body_covers_children_pairs_and_gaps():
    """c is frozen in frames 4 and 5, b, which it carries, in 5 and 6 as well; all bodies have a gap in frame 5.

    The cut begins with frame 2, so that frame 4 is row 2, and the teleport in frame 1 is not in it. Flags are bits.
    """
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b", parent="c"), SceneBody("c")))
    assembly = assemble(
        unit_cubes_on_x({"a": range(10), "b": [9] * 10, "c": [4] * 10}, scene=scene), start=2 * STEP_NS / 1e9
    )
    reported = [("frozen", "c", 4, 5), ("frozen", "b", 5, 6), ("gap", "", 5, 5), ("teleport", "a", 1, 1)]
    spans = [
        FlagSpan(kind, body, first * STEP_NS, last * STEP_NS, start=0.0, end=0.0, samples=1, action="keep")
        for kind, body, first, last in reported
    ]
    result = Flags.of(spans, assembly, scene)
    frozen, gap = (1 << FLAG_KINDS.index(kind) for kind in ("frozen", "gap"))
    expected = np.zeros((8, 3), dtype=int)
    expected[2:4, 1:] = frozen
    expected[3] |= gap
    expected[4, 1] = frozen
    assert result.bodies.tolist() == expected.tolist()
    assert [flag_word(value) for value in (0, frozen | gap)] == ["", "frozen+gap"]
    for (a, b), column in zip(assembly.pairs, result.of_pairs(assembly.pairs, 2, 5).T, strict=True):
        assert column.tolist() == (expected[2:5, a] | expected[2:5, b]).tolist()
