"""``report.html``: what was missed, where and at what price, on one self-contained page."""

from collections import Counter
from pathlib import Path

import numpy as np

from replay.base.constants import CAVEAT
from replay.comparison.misses import NEVER_FOUND
from replay.comparison.outcome import Miss, Outcome
from replay.effects.effect_summary import happened, happened_words
from replay.outputs.camera import Eye, Obstacles, overview, standing, towards_user
from replay.outputs.moments import KINDS, FocusMoment, key_moments, leading, to_do, worst_first
from replay.outputs.palette import INVENTED, MISSED, hex_of
from replay.outputs.report import tables
from replay.outputs.report.audit_parts import cause_table, count_tables, duration_table
from replay.outputs.report.bench_picture import bench_picture
from replay.outputs.report.charts import timeline, timing, titration_pictures
from replay.outputs.report.faults import fault_sections, first_of
from replay.outputs.report.markup import Markup, contents, element, page_html, page_section, page_table, picture
from replay.outputs.run_tables import cost_table, ranking_table, stage_table
from replay.outputs.words import NOT_LOOKED_FOR, address, counted
from replay.pipeline.headline import beside, doubts, headlines, price
from replay.pipeline.run_result import RunResult

CLOSE_UPS = 4
"""Misses shown as pictures; all of them stand in the table."""

FARTHER = 3.0
"""A false contact is seen from so much farther than a miss: its two bodies are apart."""

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
    lines += [element("p", line, class_="price") for line in [*_beside(result), *_next_step(result)]]
    moments = key_moments(result) if result.comparisons else []
    worst = moments[leading(result, moments)] if moments else None
    sections = _sections(result, _close_ups(result, worst))
    top = [element("div", *lines), _worst_picture(result, worst), contents(sections)]
    red = f":root {{ --missed: {hex_of(MISSED)}; --false: {hex_of(INVENTED)}; }}\n"
    return page_html(f"{name}: {_headlines(result)[0]}", top, sections, CAVEAT, red)


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


def _next_step(result: RunResult) -> list[str]:
    """What mends most of what the worst detector does wrong."""
    return [f"To do for {label}: {to_do(result, label)}." for label in worst_first(result)[:1]]


def _sections(result: RunResult, pictures: list[Markup]) -> list[Markup]:
    """What was missed, then when and why, then at what price; what few read is folded, facts and settings come last."""
    parts = []
    if result.tradeoff is not None:
        from replay.outputs.report.tradeoff import tradeoff_section

        parts.append(page_section("What accuracy costs", tradeoff_section(result.tradeoff)))
    if len(result.comparisons) > 1:
        parts.append(page_section("Detectors", page_table(ranking_table(result.summary))))
    parts += fault_sections(result)
    if pictures:
        parts.append(page_section("Close-ups", element("div", *pictures, class_="pictures")))
    parts += [page_section(f"When: {label}", timeline(result, label)) for label in result.comparisons]
    if result.detections:
        parts.append(page_section("Contacts", tables.contact_table(result)))
        costs = [timing(result), page_table(cost_table(result)), page_table(stage_table(result))]
        parts.append(page_section("What it cost in time", *costs, fold=True))
    if result.comparisons:
        causes = [cause_table(result)] if result.causes else []
        parts.append(page_section("Counts and causes", count_tables(result), *causes, fold=True))
        if (steps := duration_table(result)) is not None:
            parts.append(page_section("Which step rate would have missed it", steps, fold=True))
    if result.effects or result.summary["plan"]["not_built"]:
        parts.append(
            page_section("Effects that the scene calls for", *titration_pictures(result), tables.effect_section(result))
        )
    parts.append(page_section("What is suspicious about the recording", tables.finding_tables(result)))
    parts.append(page_section("The session", tables.fact_table(result), fold=True))
    parts.append(page_section("How to get the same again", tables.settings_table(result), fold=True))
    return parts


def _worst_picture(result: RunResult, worst: FocusMoment | None) -> Markup:
    """The worst fault, a link to its card; the bench where there is none."""
    assembly, scene = result.assembly, result.session.scene
    if worst is None or not worst.label:
        frame = len(assembly.motion) // 2
        eye = _from_farther(overview(assembly, scene, np.zeros((0, 3)), frame))
        return picture(bench_picture(assembly, scene, frame, eye), f"The bench at {assembly.motion.times[frame]:.2f} s")
    obstacles = Obstacles(assembly, scene)
    if worst.outcome == Outcome.MISSED:
        (miss,) = (one for one in result.misses[worst.label] if one.number == worst.number)
        return _close_up(result, obstacles, worst.label, miss)
    user = towards_user(assembly, scene, worst.frame, worst.point)
    eye = _from_farther(obstacles.close_up(worst.frame, worst.point, user), FARTHER)
    (false,) = (one for one in result.false[worst.label] if one.number == worst.number)
    name, frames = assembly.pair_name(worst.pair), counted(false.frames, "frame")
    png = bench_picture(assembly, scene, worst.frame, eye)
    what = f"{name} for {frames} from {false.start:.3f} s: {false.cause}"
    made = picture(png, f"False contact {false.number} of {worst.label}: {what}")
    return _leading_to(made, result, KINDS[worst.outcome], worst.number, worst.label)


def _close_ups(result: RunResult, worst: FocusMoment | None) -> list[Markup]:
    """Pictures of misses that tell most, without the worst, which stands at the top."""
    shown = [(label, miss) for label, found in result.misses.items() for miss in found]
    top = (worst.label, worst.number) if worst and worst.outcome == Outcome.MISSED else ()
    obstacles = Obstacles(result.assembly, result.session.scene)
    rest = [(label, miss) for label, miss in _telling(shown) if (label, miss.number) != top]
    return [_close_up(result, obstacles, label, miss) for label, miss in rest[:CLOSE_UPS]]


def _close_up(result: RunResult, obstacles: Obstacles, label: str, miss: Miss) -> Markup:
    there, row = standing(result.assembly, miss)
    side = towards_user(there, result.session.scene, row, miss.point)
    near = _from_farther(obstacles.close_up(row, miss.point, side, there.motion))
    png = bench_picture(there, result.session.scene, row, near, _marked(result, miss))
    red = "the faces that meet"
    if miss.touch is not None:
        red = f"the faces that touch first, between frames {miss.touch.frame} and {miss.touch.frame + 1}"
    what = f"{miss.body_a} and {miss.body_b} at {there.motion.times[row]:.3f} s, {miss.kind}: {miss.cause}; red: {red}"
    return _leading_to(picture(png, f"Miss {miss.number} of {label}: {what}"), result, "miss", miss.number, label)


def _leading_to(made: Markup, result: RunResult, kind: str, number: int, label: str) -> Markup:
    """A picture that is a link to the card of its fault."""
    return element("a", made, href="#" + address(kind, number, "" if label == first_of(result) else label))


def _telling(shown: list[tuple[str, Miss]]) -> list[tuple[str, Miss]]:
    """Misses in the order in which they deserve a picture: each detector's worst of each pair, then its second, ..."""
    worst = sorted(shown, key=lambda one: (one[1].kind != NEVER_FOUND, -one[1].cut_length, one[1].number))
    seen: Counter[tuple[str, int]] = Counter()
    turns = []
    for place, (label, miss) in enumerate(worst):
        turns.append((seen[label, miss.pair], place))
        seen[label, miss.pair] += 1
    return [worst[place] for _, place in sorted(turns)]


def _from_farther(eye: Eye, times: float = 1.35) -> Eye:
    """The same view from a little farther: a page has no way to step back."""
    away = [t + times * (p - t) for p, t in zip(eye.position, eye.target, strict=True)]
    return Eye((away[0], away[1], away[2]), eye.target)


def _marked(result: RunResult, miss: Miss) -> dict[int, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    trusted = result.detections[result.oracle]
    faces = miss.faces if trusted.face_sets is None else trusted.faces(miss.deepest, miss.pair)
    if faces is None:
        return {}
    first, second = result.assembly.pairs[miss.pair].tolist()
    return {first: np.unique(faces[:, 0]), second: np.unique(faces[:, 1])}
