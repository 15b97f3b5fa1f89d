"""Charts, plots and pictures of the page."""

import io
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from replay.comparison.outcome import Outcome
from replay.outputs.camera import Eye
from replay.outputs.report.bench_picture import bench_picture
from replay.outputs.report.charts import LABEL, LANE, RIGHT, STRETCH, WIDTH, lane_bars, timeline, timing
from replay.outputs.report.drawing import INK, PAPER, svg_in_page


def test_every_stretch_of_an_outcome_is_a_bar_at_its_time(run):
    text = timeline(run, "slow")
    times, outcome = run.assembly.motion.times, run.comparisons["slow"].outcome
    starts = []
    for column in outcome.T:
        missed = column == Outcome.MISSED
        starts += np.flatnonzero(missed & ~np.concatenate([[False], missed[:-1]])).tolist()
    bars = re.findall(r'<rect x="([0-9.]+)"[^>]*><title>MISSED: ([0-9.]+) s', text)
    assert sorted(float(at) for _, at in bars) == sorted(round(float(times[k]), 3) for k in starts)
    for x, at in bars:
        share = (float(at) - times[0]) / (times[-1] - times[0])
        assert abs(float(x) - (LABEL + (WIDTH - RIGHT - LABEL) * share)) < 0.2


def test_one_pair_is_not_called_pairs(run):
    assert len(run.assembly.pairs) == 1 and "1 pair over" in timeline(run, "slow")


def test_every_miss_has_its_number(run):
    assert numbers_in(timeline(run, "slow")) == [miss.number for miss in run.misses["slow"]]


def numbers_in(text):
    boxes = [box.split("-") for box in re.findall(r'class="miss">([0-9-]+)<', text)]
    return [number for box in boxes for number in range(int(box[0]), int(box[-1]) + 1)]


def test_numbers_of_hundreds_share_boxes_that_stand_where_they_are_and_do_not_overlap(run):
    times, one = run.assembly.motion.times, run.misses["slow"][0]
    starts = np.linspace(times[0], times[-1], 400)
    made = tuple(replace(one, number=k, start=float(at), end=float(at)) for k, at in enumerate(starts, 1))
    text = timeline(replace(run, misses={"slow": made}), "slow")
    assert numbers_in(text) == list(range(1, 401))
    boxes = [(float(x), float(w)) for x, w in re.findall(r'<rect x="([0-9.]+)" y="24" width="([0-9.]+)"', text)]
    assert 10 < len(boxes) < 60 and all(a + w < b for (a, w), (b, _) in pairwise(boxes))
    assert all(x >= LABEL and x + w < WIDTH for x, w in boxes)


def test_a_flickering_lane_shows_shares_and_hides_no_miss():
    times = np.arange(5400) / 90
    outcome = np.full(5400, Outcome.BOTH, dtype=np.uint8)
    outcome[:2700:4] = Outcome.MISSED
    outcome[4000] = Outcome.MISSED
    bar = r'<rect x="([0-9.]+)" y="(\d+)" width="([0-9.]+)" height="(\d+)"[^>]*><title>(\w+)'
    found = re.findall(bar, "".join(lane_bars(outcome, times, 0)))
    bars = [(float(x), int(y), float(width), int(high), word) for x, y, width, high, word in found]
    red = [bar for bar in bars if bar[4] == "MISSED"]
    quarter = sum(width for _, _, width, high, _ in red if high == round((LANE - 6) / 4))
    assert abs(quarter - (WIDTH - RIGHT - LABEL) / 2) < 60
    (lone,) = [bar for bar in red if bar[0] > LABEL + 0.6 * (WIDTH - RIGHT - LABEL)]
    assert lone[1:4] == (0, STRETCH, 1), "one frame of a stretch keeps a point of height"
    area = sum(width * high for _, _, width, high, _ in bars)
    assert area == pytest.approx((WIDTH - RIGHT - LABEL) // STRETCH * STRETCH * (LANE - 6)), (
        "every frame is in the lane once"
    )
    assert len(bars) < 300


def test_the_plot_names_each_detector_and_the_budget(run):
    text = timing(run)
    assert "slow, frame by frame" in text and "exact, mean of the whole motion" in text and "11.1 ms" in text
    assert timing(run) == text


def drawn(axes):
    axes.plot([0, 1], [1, 2], color="#4a86c5", marker="o", mfc=PAPER, label="one")
    axes.axhline(1.5, color=INK)
    axes.set_xlabel("seconds")
    axes.legend()
    axes.grid(True)


def test_words_and_axes_have_the_ink_of_the_page_and_nothing_is_black_or_white():
    text = svg_in_page(4, 2, "a < b", drawn).lower()
    assert text.count("currentcolor") > 10 and "var(--paper)" in text and "#4a86c5" in text
    assert not any(colour in text for colour in ("#000000", "#ffffff", INK, PAPER))
    assert text.startswith('<svg role="img" aria-label="a &lt; b"')


def test_there_is_no_card_behind_a_plot():
    text = svg_in_page(4, 2, "", lambda axes: None)
    before_the_axes = text[: text.index('id="matplotlib.axis')]
    assert "fill: none" in before_the_axes and "fill: var(--paper)" not in before_the_axes


def test_one_drawing_gives_one_text():
    assert svg_in_page(4, 2, "", drawn) == svg_in_page(4, 2, "", drawn)


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def seen(run, **options):
    miss = run.misses["slow"][0]
    x, y, z = miss.point
    eye = Eye((x + 0.05, y + 0.1, z + 0.6), miss.point)
    return pixels(bench_picture(run.assembly, run.session.scene, miss.deepest, eye, **options))


def test_bodies_are_seen_and_marked_faces_are_red(run):
    plain = seen(run)
    assert len(np.unique(plain.reshape(-1, 3), axis=0)) > 5
    marked = seen(run, marked={k: np.arange(len(body.mesh.faces)) for k, body in enumerate(run.assembly.bodies)})
    red = (marked[..., 0] > 100) & (marked[..., 1] < 0.35 * marked[..., 0])
    assert red.sum() > 200 and not ((plain[..., 0] > 100) & (plain[..., 1] < 0.35 * plain[..., 0])).any()


def test_a_body_without_a_pose_is_not_drawn(run):
    from dataclasses import replace

    motion = run.assembly.motion
    gone = type(motion)(motion.times, motion.translations, motion.rotations, np.zeros_like(motion.valid))
    empty = replace(run, assembly=replace(run.assembly, motion=gone))
    assert len(np.unique(seen(empty).reshape(-1, 3), axis=0)) == 1
