"""Colours, looks of bodies and words are the same in every output; one red means missed and nothing else."""

from itertools import combinations

import numpy as np
import pytest

from replay.auditing.fault import FaultKind
from replay.auditing.outcome import Outcome
from replay.cli.terminal import MARK_STYLES
from replay.document.tables import IN_RED, PARTLY
from replay.show import palette
from replay.show.palette import albedo, see_through, tags_of
from replay.show.words import LANES_LEGEND, lane_legend
from sessions.model.scene import Scene, SceneBody


def rgb_distance(a, b):
    """The distance of two colours in red, green and blue (0 to 255 each), without their opacity."""
    return float(np.linalg.norm(np.subtract(a[:3], b[:3])))


def lightness(colour):
    """The luminance of a colour, from 0 to 1."""
    r, g, b = (channel / 255 for channel in colour[:3])
    return 0.2126 * r**2.2 + 0.7152 * g**2.2 + 0.0722 * b**2.2


def test_nothing_but_missed_is_near_the_red():
    """Red, green and blue go from 0 to 255; 100 from the red is another hue or a far darker one.

    Others are colours of all other outcomes and verdicts, of curves, and of bodies by their tags.
    """
    others = [colour for outcome, (_, colour) in palette.OUTCOME_STYLES.items() if outcome != Outcome.MISSED]
    others += [colour for _, colour in palette.VERDICT_STYLES.values()]
    others += [*palette.SERIES_COLOURS, palette.WHITE, palette.BUDGET]
    tags = ("glass", "hand", "headset", "bench", "rod", "metal", "plastic", "stopper", "no such tag")
    others += [albedo((tag,)) for tag in tags]
    assert min(rgb_distance(palette.MISSED, other) for other in others) > 100


def test_each_kind_of_fault_has_the_same_colour_everywhere():
    """Picture and pages draw a fault in one colour, which the legend of lanes names; red is a contact never reported.

    Kinds of fault share three colours: missed, late or cut short (also interrupted), false contact.
    """
    for kind in FaultKind:
        key = palette.fault_key(kind)
        meaning = {"missed": "missed", "late": "late or cut short", "false": "false contact"}[key]
        assert palette.hex_of(palette.fault_colour(kind)) == palette.DARK_COLOURS[key], kind
        assert (palette.fault_colour(kind) == palette.MISSED) == (kind is FaultKind.NEVER_REPORTED), kind
        assert f"{palette.COLOUR_NAMES[key]}: {meaning}" in LANES_LEGEND, kind


def test_red_yellow_and_blue_differ_in_lightness():
    """Missed is red, false contact yellow, true contact blue; each is a fifth lighter than the next darker one.

    So they differ without hues.
    """
    colours = (palette.MISSED, palette.FALSE_CONTACT, palette.TRUE_CONTACT)
    darkest, middle, lightest = sorted(lightness(colour) for colour in colours)
    assert middle / darkest > 1.2
    assert lightest / middle > 1.2


def test_glass_is_translucent_and_the_user_never_hides_a_contact():
    """The fourth number of a body's colour is its opacity, 0 (not seen) to 255 (solid).

    Below 100 one sees what is inside. Hand, controller, wand and headset have 40 at most, and hide nothing. A rod is
    solid, though of glass, and thin: translucent, it would not be seen in a beaker.
    """
    least_and_most_opacity = {
        ("glass", "vessel"): (1, 99),
        ("glass", "tool", "rod"): (255, 255),
        ("bench", "furniture"): (255, 255),
        ("hand",): (1, 40),
        ("controller",): (1, 40),
        ("headset",): (1, 40),
        ("wand",): (1, 40),
    }
    for tags, (least_opacity, most_opacity) in least_and_most_opacity.items():
        _red, _green, _blue, opacity = albedo(tags)
        assert least_opacity <= opacity <= most_opacity, tags


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


@pytest.mark.parametrize("colours", [palette.LIGHT_COLOURS, palette.DARK_COLOURS], ids=["light", "dark"])
def test_kinds_differ_for_every_kind_of_colour_vision(colours):
    """Colours of reference, true contact, missed, late and false, as people without a kind of cone see them.

    Distances are of CIE L*a*b*: 10 are distinct side by side; small marks at a distance need more, 20.
    """
    least_distance = 20.0
    linear = {
        kind: ((np.array(palette.rgba_of(text)[:3]) / 255 + 0.055) / 1.055) ** 2.4 for kind, text in colours.items()
    }  # sRGB as light, linear from 0 to 1
    for eyes, matrix in VISION.items():
        perceived = [lab(np.array(matrix) @ value) for value in linear.values()]
        assert min(float(np.linalg.norm(a - b)) for a, b in combinations(perceived, 2)) > least_distance, eyes


def test_pages_picture_and_terminal_have_the_same_colours():
    """A style sheet has each colour as a variable; the picture and the terminal have those of a dark page."""
    style_sheet = palette.page_colours()
    for colours in (palette.LIGHT_COLOURS, palette.DARK_COLOURS):
        for kind, colour in colours.items():
            assert f"--{kind}:{colour}" in style_sheet
    dark = palette.DARK_COLOURS
    assert palette.hex_of(palette.MISSED) == dark["missed"]
    assert palette.hex_of(palette.FALSE_CONTACT) == dark["false"]
    assert palette.hex_of(palette.TRUE_CONTACT) == dark["right"]
    assert dark["missed"] in MARK_STYLES[IN_RED]
    assert dark["late"] in MARK_STYLES[PARTLY]


def test_lane_legend_names_present_outcomes_and_who_missed():
    """A lane has contact that both detectors report, contact that one misses, and none (a gap, without a colour).

    The legend has an entry a colour, four spaces apart; pink is for late parts where there are any.
    """
    rows = {
        "nobody named": ("", False, ["red: missed", "blue: both"]),
        "detector named": ("hull50", False, ["red: missed by hull50", "blue: both"]),
        "with late contacts": ("hull50", True, ["red: missed by hull50", "pink: late or cut short", "blue: both"]),
    }
    for row, (missing_detector, has_late, legend) in rows.items():
        outcomes = [Outcome.BOTH, Outcome.MISSED, Outcome.NEITHER]
        assert lane_legend(outcomes, missing_detector, has_late=has_late).split("    ") == legend, row


def test_tags_of_a_body_default_to_its_name():
    """Tags say what a body looks like. Without declared ones, the words of its name are tags.

    They are in small letters, without numbers; a body that the scene does not mention has them too.
    """
    scene = Scene(bodies=(SceneBody("Glass rod 2"), SceneBody("tool", tags=("metal",))))
    assert tags_of("Glass rod 2", scene) == ("glass", "rod")
    assert tags_of("tool", scene) == ("metal",)
    assert tags_of("left_hand", scene) == ("left", "hand")


def test_body_before_a_contact_is_see_through_except_the_bench():
    """A body between the eye and a contact gets a lower opacity (of 255, the fourth number of a colour)."""
    *_, usual_opacity = albedo(("rod",))
    *_, opacity_before_contact = see_through(("rod",))
    assert opacity_before_contact < usual_opacity == 255
    assert see_through(("bench",)) == albedo(("bench",))
