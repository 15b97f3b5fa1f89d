"""More sessions with a truth in closed form than the product offers: rotation, grazing, containment."""

from functools import partial

import numpy as np
from support.prisms import prism

from sessions.geometry.rotations import quaternion_about
from sessions.geometry.solids import box, pointed_ball
from sessions.synthetic import analytic
from sessions.synthetic.analytic import BALL, AnalyticCase, on_axis, within
from sessions.synthetic.motion_profiles import Polyline, Swing, joined
from sessions.synthetic.paths import Standing
from sessions.synthetic.truth import ordered

SMALL_BALL = 1.0 / 64.0


def spinning_rod(rng, seconds):
    """A rod turns on the spot to and fro past a post: nothing moves but the rotation."""
    half_width, post, distance, sides = 1.0 / 256.0, 1.0 / 256.0, 0.125, 16
    profile = Swing(0.0, 1.4, float(rng.uniform(0.8, 1.2)), float(rng.uniform(0.0, 0.3)))

    def path(times):
        return np.zeros((*times.shape, 3)), quaternion_about((0.0, 1.0, 0.0), profile(times))

    def contact(level):
        reach = half_width + post + level
        angle = float(np.arcsin(reach / distance))
        return profile.between(-angle, angle, seconds) if reach >= 0.0 else []

    return AnalyticCase(
        {"rod": box((0.3, 2.0 * half_width, 2.0 * half_width)), "post": prism(sides, post, 0.1)},
        {"rod": path, "post": Standing((distance, 0.0, 0.0))},
        {ordered("post", "rod"): contact},
        tessellation=post * (1.0 - np.cos(np.pi / sides)),
        lever=0.15,
    )


def grazing_ball(rng, seconds):
    """A ball grazes a plate with clearances 0, 1, -1, 4 and -4 micrometres, at whole seconds."""
    plate, clearances = 1.0 / 64.0, (0.0, 1e-6, -1e-6, 4e-6, -4e-6)
    count = max(1, int(seconds))
    heights = np.full(2 * count + 1, BALL + 0.04)
    heights[1::2] = [BALL + clearances[int(k) % 5] for k in rng.permutation(count)]
    profile = Polyline(tuple(0.5 + 0.5 * np.arange(len(heights))), tuple(heights))
    return AnalyticCase(
        {"ball": pointed_ball(BALL), "plate": box((0.5, plate, 0.5))},
        {"ball": on_axis(1, profile), "plate": Standing((0.0, -plate / 2.0, 0.0))},
        {ordered("ball", "plate"): lambda level: profile.between(-BALL, BALL + level, seconds)},
    )


def ball_in_box(rng, seconds):
    """A ball inside a closed box comes out through one wall or the other: contained, contact, clear."""
    half, pair = 1.0 / 16.0, ordered("ball", "box")
    profile = Swing(0.0, half + SMALL_BALL + 0.02, float(rng.uniform(2.5, 3.5)), float(rng.uniform(0.0, 1.0)))

    def contact(level):
        low, high = half - SMALL_BALL - level, half + SMALL_BALL + level
        return joined([*profile.between(low, high, seconds), *profile.between(-high, -low, seconds)], seconds)

    return AnalyticCase(
        {"ball": pointed_ball(SMALL_BALL), "box": box((2.0 * half, 2.0 * half, 2.0 * half))},
        {"ball": on_axis(0, profile), "box": Standing((0.0, 0.0, 0.0))},
        {pair: contact},
        {pair: within(profile, half - SMALL_BALL, seconds)},
    )


ANALYTIC = analytic.ANALYTIC | {
    make.__name__.replace("_", "-"): make for make in (spinning_rod, grazing_ball, ball_in_box)
}
make_analytic = partial(analytic.make_analytic, cases=ANALYTIC)
