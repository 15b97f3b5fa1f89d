"""One red means missed and nothing else; bodies look like their tags say; the worst pairs come first."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdcore import Verdict
from replay.comparison.outcome import Comparison, Miss, Outcome
from replay.outputs import palette
from replay.outputs.lanes import number_boxes, ranked_pairs
from replay.outputs.materials import albedo, is_ghost, tags_of
from replay.outputs.rerun_log.columns import packed
from sessions import Scene
from sessions.model.scene import SceneBody

Rgba = palette.Rgba


def hue_distance(a: Rgba, b: Rgba) -> float:
    return float(np.linalg.norm(np.subtract(a[:3], b[:3])))


def lightness(colour: Rgba) -> float:
    r, g, b = (channel / 255 for channel in colour[:3])
    return 0.2126 * r**2.2 + 0.7152 * g**2.2 + 0.0722 * b**2.2


def test_nothing_but_missed_is_near_the_red() -> None:
    others = [colour for outcome, (_, colour) in palette.OUTCOMES.items() if outcome != Outcome.MISSED]
    others += [colour for _, colour in palette.VERDICTS.values()]
    others += [*palette.SERIES, *palette.DOUBTS, palette.WHITE, palette.BUDGET]
    others += [
        albedo((tag,)) for tag in ("glass", "hand", "headset", "bench", "rod", "metal", "plastic", "stopper", "?")
    ]
    assert min(hue_distance(palette.MISSED, other) for other in others) > 100


def test_red_yellow_and_blue_differ_in_lightness_too() -> None:
    values = sorted(lightness(colour) for colour in (palette.MISSED, palette.INVENTED, palette.FOUND))
    assert values[1] / values[0] > 1.2
    assert values[2] / values[1] > 1.2


def test_silence_has_no_word_and_everything_else_has_one() -> None:
    assert set(palette.OUTCOMES) == set(Outcome) - {Outcome.NEITHER}
    assert set(palette.VERDICTS) == set(Verdict) - {Verdict.CLEAR}


def test_verdict_lanes_use_the_words_of_the_glossary() -> None:
    assert all(word == Verdict(code).name for code, (word, _) in palette.VERDICTS.items())


def test_colours_are_packed_red_first() -> None:
    assert packed([(1, 2, 3, 4)]).tolist() == [0x01020304]
    assert packed([]).dtype == np.uint32


def test_glass_is_translucent_and_a_rod_of_glass_is_not() -> None:
    assert albedo(("glass", "vessel"))[3] < 60
    assert albedo(("glass", "tool", "rod"))[3] == 255


@pytest.mark.parametrize("tag", ["hand", "controller", "headset", "wand"])
def test_what_belongs_to_the_user_never_hides_a_contact(tag: str) -> None:
    assert albedo((tag,))[3] <= 40
    assert is_ghost((tag,))


def test_furniture_is_no_ghost() -> None:
    assert not is_ghost(("bench", "furniture"))


def test_declared_tags_win_over_the_name() -> None:
    scene = Scene("s", (SceneBody("hand-left", shape="box", tags=("glass",)),))
    assert tags_of("hand-left", scene) == ("glass",)


def test_a_body_nobody_declared_is_told_by_its_name() -> None:
    assert "hand" in tags_of("Hand_Left2", Scene())
    assert "bench" in tags_of("lab bench", Scene())


def test_pairs_are_ranked_by_missed_frames_and_held_ones_come_last() -> None:
    outcome = np.zeros((10, 5), dtype=np.uint8)
    outcome[:1, 0], outcome[:3, 1], outcome[:5, 2] = Outcome.MISSED, Outcome.MISSED, Outcome.BOTH
    outcome[:9, 3] = Outcome.MISSED
    held = np.array([False, False, False, True, False])
    assert ranked_pairs(Comparison("s", "o", outcome), held) == [1, 0, 2, 3]


def test_a_pair_that_was_only_left_out_has_no_lane() -> None:
    outcome = np.full((4, 1), Outcome.LEFT_OUT, dtype=np.uint8)
    assert ranked_pairs(Comparison("s", "o", outcome), np.array([False])) == []


def at(number: int, start: float, length: float = 0.03) -> Miss:
    return Miss(
        number=number, pair=0, body_a="a", body_b="b", first=0, last=0, start=start, end=start + length,
        kind="never found", episode=1, deepest=0, point=(0, 0, 0), normal=(0, 1, 0), face_pairs=1, cut_length=0.0,
    )  # fmt: skip


@given(st.lists(st.floats(0, 60), min_size=1, max_size=300))
def test_boxes_never_overlap_and_hold_every_number_once(starts: list[float]) -> None:
    misses = [at(number, start) for number, start in enumerate(sorted(starts), 1)]
    boxes = number_boxes(misses, 60_000_000_000)
    assert all(a[2] <= b[1] for a, b in pairwise(boxes))
    named = []
    for label, start, end in boxes:
        low, _, high = label.partition("-")
        named += range(int(low), int(high or low) + 1)
        assert end - start >= (0.011 + 0.0055 * len(label)) * 60e9 - 1
    assert named == [miss.number for miss in misses]


def test_hundreds_of_misses_become_boxes_that_can_be_counted() -> None:
    misses = [at(number, number * 0.15) for number in range(1, 400)]
    assert 10 <= len(number_boxes(misses, 60_000_000_000)) <= 60


def test_lone_misses_keep_their_own_number() -> None:
    assert [box[0] for box in number_boxes([at(1, 5.0), at(2, 20.0)], 60_000_000_000)] == ["1", "2"]
