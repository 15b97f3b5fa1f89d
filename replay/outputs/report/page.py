"""``report.html``: what was missed, where and at what price, on one self-contained page."""

from collections import Counter
from pathlib import Path

import numpy as np

from replay.base.constants import CAVEAT
from replay.comparison.misses import NEVER_FOUND
from replay.comparison.outcome import Miss
from replay.effects.effect_summary import happened, happened_words
from replay.outputs.camera import Eye, Obstacles, overview, standing, towards_user
from replay.outputs.palette import MISSED, hex_of
from replay.outputs.report import tables
from replay.outputs.report.audit_parts import cause_table, count_tables, duration_table, heat_map, latency_histogram
from replay.outputs.report.bench_picture import bench_picture
from replay.outputs.report.charts import timeline, timing
from replay.outputs.report.markup import Markup, element, joined, page_html, page_section, page_table, picture
from replay.outputs.run_tables import cost_table, ranking_table, stage_table
from replay.outputs.words import NOT_LOOKED_FOR, counted
from replay.pipeline.headline import beside, doubts, headlines, price
from replay.pipeline.run_result import RunResult

CLOSE_UPS = 4
"""Misses shown as pictures; all of them stand in the table."""

EVENTS_FIRST = 6
"""Events listed before all else, where no contact was looked for."""


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a run; the same result gives the same bytes."""
    path.write_text(report_html(result), encoding="utf-8", newline="\n")


def report_html(result: RunResult) -> str:
    """The page as text."""
    name = result.session.scene.name or Path(result.session.origin).stem or "session"
    lines = [element("p", f"Replay of {name}"), *(element("p", line, class_="doubt") for line in doubts(result))]
    lines += [element("h1", line) for line in _headlines(result)]
    if len(result.comparisons) > 1:
        lines.append(page_table(ranking_table(result.summary)))
    lines += [element("p", line, class_="price") for line in _beside(result)]
    red = f":root {{ --missed: {hex_of(MISSED)}; }}\n"
    return page_html(f"{name}: {_headlines(result)[0]}", lines, _sections(result), CAVEAT, red)


def _headlines(result: RunResult) -> list[str]:
    if result.tradeoff is not None:
        return [result.tradeoff.answer]
    if result.comparisons:
        return [f"{words}, compared with {result.oracle}" for words in headlines(result)]
    if result.detections:
        counts = [f"{counted(len(found), 'contact')} found by {label}" for label, found in result.episodes.items()]
        return [", ".join(counts)]
    events = Counter(event.name for _, event in happened(result.effects))
    return [", ".join(f"{count} {name}" for name, count in events.items()) or NOT_LOOKED_FOR]


def _beside(result: RunResult) -> list[str]:
    """What stands below the headlines: what else is wrong, and the price; without a detector, what happened."""
    if result.detections or not happened(result.effects):
        return [*beside(result), *price(result)]
    return [*happened_words(result.effects, EVENTS_FIRST), f"{NOT_LOOKED_FOR}."]


def _sections(result: RunResult) -> list[Markup]:
    """What was missed, then why, then at what price; facts and settings come last."""
    parts = []
    if result.tradeoff is not None:
        from replay.outputs.report.tradeoff import tradeoff_section

        parts.append(page_section("What accuracy costs", tradeoff_section(result.tradeoff)))
    parts += [page_section(f"When: {label}", timeline(result, label)) for label in result.comparisons]
    parts.append(page_section("The bench", joined(_pictures(result))))
    if result.detections:
        parts.append(page_section("Contacts", tables.contact_table(result)))
    if result.comparisons:
        causes = [cause_table(result)] if result.causes else []
        parts.append(page_section("What was missed, and why", count_tables(result), heat_map(result), *causes))
    parts += [
        page_section(f"Every miss of {label}", tables.miss_table(result, label))
        for label in result.comparisons
        if result.misses[label]
    ]
    if result.detections:
        costs = [page_table(cost_table(result)), page_table(stage_table(result))]
        parts.append(page_section("What it cost in time", timing(result), latency_histogram(result), *costs))
    if result.comparisons and (steps := duration_table(result)) is not None:
        parts.append(page_section("Which step rate would have missed it", steps))
    if result.effects or result.summary["plan"]["not_built"]:
        parts.append(page_section("Effects that the scene calls for", tables.effect_section(result)))
    parts.append(page_section("What is suspicious about the recording", tables.finding_tables(result)))
    parts.append(page_section("The session", tables.fact_table(result)))
    parts.append(page_section("How to get the same again", tables.settings_table(result)))
    return parts


def _pictures(result: RunResult) -> list[Markup]:
    assembly, scene = result.assembly, result.session.scene
    shown = [(label, miss) for label, found in result.misses.items() for miss in found]
    points = np.array([miss.point for _, miss in shown], dtype=np.float64).reshape(-1, 3)
    frame = shown[0][1].deepest if shown else len(assembly.motion) // 2
    eye = overview(assembly, scene, points, frame)
    words = f"The bench at {assembly.motion.times[frame]:.2f} s"
    pictures = [picture(bench_picture(assembly, scene, frame, _from_farther(eye)), words)]
    obstacles = Obstacles(assembly, scene)
    for label, miss in _telling(shown)[:CLOSE_UPS]:
        there, row = standing(assembly, miss)
        side = towards_user(there, scene, row, miss.point)
        near = _from_farther(obstacles.close_up(row, miss.point, side, there.motion))
        png = bench_picture(there, scene, row, near, _marked(result, miss))
        red = "the faces that meet"
        if miss.touch is not None:
            red = f"the faces that touch first, between frames {miss.touch.frame} and {miss.touch.frame + 1}"
        what = f"{miss.body_a} and {miss.body_b} at {there.motion.times[row]:.3f} s, {miss.kind}; red: {red}"
        pictures.append(picture(png, f"Miss {miss.number} of {label}: {what}"))
    return [element("div", *pictures, class_="pictures")]


def _telling(shown: list[tuple[str, Miss]]) -> list[tuple[str, Miss]]:
    """Misses in the order in which they deserve a picture: each detector's worst of each pair, then its second, ..."""
    worst = sorted(shown, key=lambda one: (one[1].kind != NEVER_FOUND, -one[1].cut_length, one[1].number))
    seen: Counter[tuple[str, int]] = Counter()
    turns = []
    for place, (label, miss) in enumerate(worst):
        turns.append((seen[label, miss.pair], place))
        seen[label, miss.pair] += 1
    return [worst[place] for _, place in sorted(turns)]


def _from_farther(eye: Eye) -> Eye:
    """The same view from a little farther: a page has no way to step back."""
    away = [t + 1.35 * (p - t) for p, t in zip(eye.position, eye.target, strict=True)]
    return Eye((away[0], away[1], away[2]), eye.target)


def _marked(result: RunResult, miss: Miss) -> dict[int, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    trusted = result.detections[result.oracle]
    faces = miss.faces if trusted.face_sets is None else trusted.faces(miss.deepest, miss.pair)
    if faces is None:
        return {}
    first, second = result.assembly.pairs[miss.pair].tolist()
    return {first: np.unique(faces[:, 0]), second: np.unique(faces[:, 1])}
