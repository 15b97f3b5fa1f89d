"""Colours, looks of bodies and words are the same in every output; one red means missed and nothing else."""

import numpy as np
import pytest

from replay.auditing.fault import FaultKind
from replay.auditing.outcome import Outcome
from replay.cli.terminal import MARK_STYLES
from replay.document.tables import IN_RED, PARTLY
from replay.show import palette
from replay.show.palette import albedo, see_through, tags_of
from replay.show.words import LANES_LEGEND, PINK_LEGEND, lane_legend
from sessions.model.scene import Scene, SceneBody


def hue_distance(a, b):
    """The distance of two colours, without their opacity."""
    return float(np.linalg.norm(np.subtract(a[:3], b[:3])))


def lightness(colour):
    """The luminance of a colour, from 0 to 1."""
    r, g, b = (channel / 255 for channel in colour[:3])
    return 0.2126 * r**2.2 + 0.7152 * g**2.2 + 0.0722 * b**2.2


def test_nothing_but_missed_is_near_the_red():
    """The distance in red, green and blue (0 to 255) to outcomes, verdicts, curves and bodies."""
    others = [colour for outcome, (_, colour) in palette.OUTCOME_STYLES.items() if outcome != Outcome.MISSED]
    others += [colour for _, colour in palette.VERDICT_STYLES.values()]
    others += [*palette.SERIES_COLOURS, palette.WHITE, palette.BUDGET]
    others += [
        albedo((tag,)) for tag in ("glass", "hand", "headset", "bench", "rod", "metal", "plastic", "stopper", "?")
    ]
    assert min(hue_distance(palette.MISSED, other) for other in others) > 100


@pytest.mark.parametrize("kind", FaultKind)
def test_each_kind_of_fault_has_the_same_colour_everywhere(kind):
    """The red is only for contacts never reported; the legend of lanes names each colour."""
    key = palette.fault_key(kind)
    assert palette.hex_of(palette.fault_colour(kind)) == palette.DARK_COLOURS[key]
    assert (palette.fault_colour(kind) == palette.MISSED) == (kind is FaultKind.NEVER_REPORTED)
    words = {"missed": "missed", "late": "late or cut short", "false": "false contact"}
    assert f"{palette.COLOUR_NAMES[key]}: {words[key]}" in LANES_LEGEND


def test_red_yellow_and_blue_differ_in_lightness():
    """Each is at least a fifth lighter than the next, so that they differ without colour."""
    values = sorted(lightness(colour) for colour in (palette.MISSED, palette.FALSE_CONTACT, palette.TRUE_CONTACT))
    assert values[1] / values[0] > 1.2
    assert values[2] / values[1] > 1.2


@pytest.mark.parametrize(
    ("tags", "least", "most"),
    [("glass vessel", 1, 99), ("glass tool rod", 255, 255), ("bench furniture", 255, 255)]
    + [(tag, 1, 40) for tag in ("hand", "controller", "headset", "wand")],
)
def test_glass_is_translucent_and_the_user_never_hides_a_contact(tags, least, most):
    """``least`` and ``most`` opacity, of 255."""
    assert least <= albedo(tuple(tags.split()))[3] <= most


VISION = {
    "protan": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deutan": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritan": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
    "usual": np.eye(3),
}
"""Linear RGB as people see it who lack a kind of cone. Source: Machado, Oliveira, Fernandes (2009), IEEE TVCG 15(6)."""


def lab(linear):
    """CIE L*a*b* (D65) of linear RGB."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(np.maximum(to_xyz @ np.clip(linear, 0, 1) / (0.9505, 1.0, 1.089), 0.008856))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("eyes", VISION)
@pytest.mark.parametrize("colours", [palette.LIGHT_COLOURS, palette.DARK_COLOURS], ids=["light", "dark"])
def test_kinds_differ_for_every_kind_of_colour_vision(colours, eyes):
    """Distances are of CIE L*a*b*: ten are distinct side by side; small marks at a distance need more, 20."""
    linear = {
        kind: ((np.array(palette.rgba_of(text)[:3]) / 255 + 0.055) / 1.055) ** 2.4 for kind, text in colours.items()
    }
    perceived = {kind: lab(np.array(VISION[eyes]) @ value) for kind, value in linear.items()}
    pairs = [(a, b) for a in perceived for b in perceived if a < b]
    assert min(float(np.linalg.norm(perceived[a] - perceived[b])) for a, b in pairs) > 20


def test_pages_picture_and_terminal_share_the_colours():
    """The page's style, the picture's constants and the terminal's marks, by kind."""
    css = palette.page_colours()
    assert all(
        f"--{kind}:{colour}" in css
        for colours in (palette.LIGHT_COLOURS, palette.DARK_COLOURS)
        for kind, colour in colours.items()
    )
    assert [palette.hex_of(colour) for colour in (palette.MISSED, palette.FALSE_CONTACT, palette.TRUE_CONTACT)] == [
        palette.DARK_COLOURS[kind] for kind in ("missed", "false", "right")
    ]
    assert palette.DARK_COLOURS["missed"] in MARK_STYLES[IN_RED] and palette.DARK_COLOURS["late"] in MARK_STYLES[PARTLY]


@pytest.mark.parametrize(
    ("missing_detector", "has_late", "legend"),
    [
        ("", False, ["red: missed", "blue: both"]),
        ("hull50", False, ["red: missed by hull50", "blue: both"]),
        ("hull50", True, ["red: missed by hull50", PINK_LEGEND, "blue: both"]),
    ],
)
def test_lane_legend_names_present_outcomes_and_who_missed(missing_detector, has_late, legend):
    """Contact is reported by both, or missed; the legend says by whom if that is known, and of late parts in pink."""
    outcomes = [Outcome.BOTH, Outcome.MISSED, Outcome.NEITHER]
    assert lane_legend(outcomes, missing_detector, has_late=has_late).split("    ") == legend


def test_tags_of_a_body_default_to_its_name():
    """Words of a name are tags, in small letters and without a number; declared tags come first."""
    scene = Scene(bodies=(SceneBody("Glass rod 2"), SceneBody("tool", tags=("metal",))))
    names = ("Glass rod 2", "tool", "left_hand")
    assert [tags_of(name, scene) for name in names] == [("glass", "rod"), ("metal",), ("left", "hand")]


def test_body_before_a_contact_is_see_through_except_the_bench():
    """The fourth number of a colour is its opacity, of 255."""
    assert see_through(("rod",))[3] < albedo(("rod",))[3] == 255
    assert see_through(("bench",)) == albedo(("bench",))
