import numpy as np
from support.small_worlds import STEP_NS, unit_cubes_on_x

from replay.prepare.assemble import assemble
from replay.prepare.flags import FLAG_KINDS, Flags, FlagSpan, flag_word
from sessions import Scene
from sessions.model.scene import SceneBody


def test_flag_of_a_body_covers_children_pairs_and_gaps():
    """c is frozen in frames 4 and 5, b, which it carries, in 5 and 6 as well; all bodies have a gap in frame 5.

    The cut begins with frame 2, so that frame 4 is row 2, and the teleport in frame 1 is not in it. A flag is the bit
    of its kind; the flags of a pair are those of both bodies.
    """
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b", parent="c"), SceneBody("c")))
    session = unit_cubes_on_x({"a": range(10), "b": [9] * 10, "c": [4] * 10}, scene=scene)
    assembly = assemble(session, start=2 * STEP_NS / 1e9)
    assert assembly.names == ("a", "b", "c")
    reported = [("frozen", "c", 4, 5), ("frozen", "b", 5, 6), ("gap", "", 5, 5), ("teleport", "a", 1, 1)]
    spans = [
        FlagSpan(kind, body, first * STEP_NS, last * STEP_NS, start=0.0, end=0.0, samples=1, action="keep")
        for kind, body, first, last in reported
    ]
    flags = Flags.of(spans, assembly, scene)

    frozen, gap = (1 << FLAG_KINDS.index(kind) for kind in ("frozen", "gap"))
    expected = np.array(
        [
            # a, b, c
            [0, 0, 0],  # frame 2
            [0, 0, 0],
            [0, frozen, frozen],  # frame 4
            [gap, frozen | gap, frozen | gap],
            [0, frozen, 0],
            [0, 0, 0],
            [0, 0, 0],
            [0, 0, 0],  # frame 9
        ]
    )
    assert flags.bodies.tolist() == expected.tolist()
    rows_of_frames_4_to_6 = slice(2, 5)
    flags_of_pairs = flags.of_pairs(assembly.pairs, 2, 5)
    for (first, second), column in zip(assembly.pairs, flags_of_pairs.T, strict=True):
        of_both = expected[rows_of_frames_4_to_6, first] | expected[rows_of_frames_4_to_6, second]
        assert column.tolist() == of_both.tolist()


def test_flag_word_lists_the_kinds_of_its_bits():
    """Each kind of flag of a frame, as frozen or gap, is a bit: none has no word, two are joined by a plus sign."""
    frozen, gap = (1 << FLAG_KINDS.index(kind) for kind in ("frozen", "gap"))
    assert flag_word(0) == ""
    assert flag_word(frozen | gap) == "frozen+gap"
