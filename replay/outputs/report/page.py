"""``report.html``: what was missed, where and at what price, on one self-contained page."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.numerics import FloatArray, place_points
from replay.base.constants import CAVEAT
from replay.comparison.false_contacts import FalseContact
from replay.comparison.misses import NEVER_FOUND
from replay.comparison.outcome import Miss
from replay.effects.effect_summary import RESULTS, happened, happened_words
from replay.effects.effect_summary import leading as leading_event
from replay.outputs.camera import Eye, Obstacles, framing, overview, standing, towards_user
from replay.outputs.moments import FocusMoment, key_moments, leading, to_do, worst_first
from replay.outputs.palette import INVENTED, MISSED, hex_of
from replay.outputs.report import tables
from replay.outputs.report.bench_picture import bench_picture
from replay.outputs.report.charts import timeline, timing, titration_pictures
from replay.outputs.report.faults import fault_sections, link_to
from replay.outputs.report.markup import Markup, Part, contents, element, page_html, page_section, picture
from replay.outputs.run_tables import cost_table, ranking_table, stage_table
from replay.outputs.words import NOT_LOOKED_FOR, counted, tallied
from replay.pipeline.headline import beside, doubts, headlines, price
from replay.pipeline.run_result import RunResult
from replay.pipeline.summary import session_name

CLOSE_UPS = 4
"""Misses shown as pictures; all of them stand in the table."""

EVENTS_FIRST = 6
"""Events listed before all else, where no contact was looked for."""


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a run; the same result gives the same bytes."""
    path.write_text(report_html(result), encoding="utf-8", newline="\n")


def report_html(result: RunResult) -> str:
    """The page as text."""
    name = session_name(result.session, result.summary["session"]["id"])
    answers, moments = _headlines(result), key_moments(result) if result.comparisons else []
    worst = moments[leading(result, moments)] if moments else None
    said = [f"To do for {label}: {to_do(result, label)}." for label in worst_first(result)[:1]]
    lines = [element("p", f"Replay of {name}"), *(element("p", line, class_="doubt") for line in doubts(result))]
    lines += [element("h1", line) for line in answers]
    lines += [element("p", line, class_="price") for line in [*_beside(result), *said]]
    sections = [page_section(title, *parts, fold=title in FOLDED) for title, parts in _sections(result, worst) if parts]
    top = [element("div", *lines), _worst_picture(result, worst), contents(sections)]
    red = f":root {{ --missed: {hex_of(MISSED)}; --false: {hex_of(INVENTED)}; }}\n"
    return page_html(f"{name}: {answers[0]}", top, sections, CAVEAT, red)


def _headlines(result: RunResult) -> list[str]:
    if result.tradeoff is not None:
        return [result.tradeoff.answer]
    if result.comparisons:
        return headlines(result)
    if result.detections:
        counts = [f"{counted(len(found), 'contact')} found by {label}" for label, found in result.episodes.items()]
        return [", ".join(counts)]
    best = leading_event(result.effects)
    if best is not None and best.name in RESULTS:
        return [f"{best.text[:1].upper()}{best.text[1:]}"]
    return [tallied(Counter(event.name for _, event in happened(result.effects))) or NOT_LOOKED_FOR]


def _beside(result: RunResult) -> list[str]:
    """What stands below the headlines: what else is wrong, and the price; without a detector, what happened."""
    if result.detections or not happened(result.effects):
        return [*beside(result), *price(result)]
    return [*happened_words(result.effects, EVENTS_FIRST), f"{NOT_LOOKED_FOR}."]


COSTS, COUNTS, RATES = "What it cost in time", "Counts and causes", "Which step rate would have missed it"
SESSION, AGAIN = "The session", "How to get the same again"
FOLDED: Final = frozenset({COSTS, COUNTS, RATES, SESSION, AGAIN})
"""Sections that few read."""


def _sections(result: RunResult, worst: FocusMoment | None) -> Iterator[tuple[str, Iterable[Part]]]:
    """What was missed, then when and why, then at what price; facts and settings come last. None without a part."""
    if result.tradeoff is not None:
        from replay.outputs.report.tradeoff import tradeoff_parts

        yield "What accuracy costs", tradeoff_parts(result.tradeoff)
    if len(result.comparisons) > 1:
        yield "Detectors", [ranking_table(result, intervals=True)]
    yield from fault_sections(result)
    if pictures := _close_ups(result, worst):
        yield "Close-ups", [element("div", *pictures, class_="pictures")]
    yield from ((f"When: {label}", [timeline(result, label)]) for label in worst_first(result))
    if result.detections:
        yield "Contacts", tables.contact_tables(result)
        yield COSTS, [timing(result), cost_table(result), stage_table(result)]
    if result.comparisons:
        yield COUNTS, tables.count_tables(result)
        yield RATES, tables.duration_tables(result)
    if result.effects:
        yield "Effects that the scene calls for", [*titration_pictures(result), *tables.effect_parts(result)]
    yield "What is suspicious about the recording", tables.finding_parts(result)
    yield SESSION, [tables.fact_table(result)]
    yield AGAIN, [tables.settings_table(result)]


def _worst_picture(result: RunResult, worst: FocusMoment | None) -> Markup:
    """The worst fault, a link to its card; the bench where there is none."""
    assembly, scene = result.assembly, result.session.scene
    if worst is None or worst.of is None:
        frame = len(assembly.motion) // 2
        eye = _from_farther(overview(assembly, scene, np.zeros((0, 3)), frame))
        return picture(bench_picture(assembly, scene, frame, eye), f"The bench at {assembly.motion.times[frame]:.2f} s")
    return _fault_picture(result, Obstacles(assembly, scene), worst.label, worst.of)


def _close_ups(result: RunResult, worst: FocusMoment | None) -> list[Markup]:
    """Pictures of misses that tell most, without the worst, which stands at the top."""
    obstacles, top = Obstacles(result.assembly, result.session.scene), None if worst is None else worst.of
    found = _telling([(label, miss) for label, found in result.misses.items() for miss in found])
    rest = [(label, miss) for label, miss in found if miss is not top]
    return [_fault_picture(result, obstacles, label, miss) for label, miss in rest[:CLOSE_UPS]]


def _fault_picture(result: RunResult, obstacles: Obstacles, label: str, one: Miss | FalseContact) -> Markup:
    """A picture that is a link to the card of its fault: of a miss its faces, of a false contact what invents it."""
    there, row = standing(result.assembly, one) if isinstance(one, Miss) else (result.assembly, one.widest)
    eye = obstacles.close_up(row, one.point, towards_user(there, result.session.scene, row, one.point), there.motion)
    marked, solids = {}, dict[int, TriangleMesh]()
    if isinstance(one, Miss):
        title, eye, marked = "Miss", _from_farther(eye), _marked(result, one)
        red = "the faces that meet"
        if one.touch is not None:
            red = f"the faces that touch first, between frames {one.touch.frame} and {one.touch.frame + 1}"
        what = f"{one.body_a} and {one.body_b} at {there.motion.times[row]:.3f} s, {one.kind}: {one.cause}; red: {red}"
    else:
        title, solids = "False contact", _solids(result, label, one)
        eye = framing(_of_pair(result, one, solids), np.subtract(eye.position, eye.target))
        name, frames = there.pair_name(one.pair), counted(one.frames, "frame")
        what = f"{name} for {frames} from {one.start:.3f} s: {one.cause}" + "; yellow: the solids" * bool(solids)
    png = bench_picture(there, result.session.scene, row, eye, marked, solids)
    return element(
        "a", picture(png, f"{title} {one.number} of {label}: {what}"), href=f"#{link_to(result, label, one)}"
    )


def _solids(result: RunResult, label: str, one: FalseContact) -> dict[int, TriangleMesh]:
    """What the detector puts in place of the meshes of a pair, where that is not the mesh itself."""
    colliders = getattr(result.detectors.get(label), "colliders", ())
    bodies = result.assembly.bodies
    ends = result.assembly.pairs[one.pair].tolist() if colliders else ()
    return {body: colliders[body].mesh for body in ends if colliders[body].mesh is not bodies[body].mesh}


def _of_pair(result: RunResult, one: FalseContact, solids: Mapping[int, TriangleMesh]) -> FloatArray:
    """Vertices of a pair or its solids no farther from a false contact than the smaller is large, world (n, 3)."""
    motion, assembly = result.assembly.motion, result.assembly
    points = [
        place_points(mesh.vertices, motion.rotations[one.widest, body], motion.translations[one.widest, body])
        for body in assembly.pairs[one.pair].tolist()
        for mesh in (solids.get(body, assembly.bodies[body].mesh),)
    ]
    # A bench top is longer than a room: of it is shown what is near.
    near = min(float(np.linalg.norm(np.ptp(some, axis=0))) for some in points)
    away = np.linalg.norm(np.concatenate(points) - one.point, axis=1)
    return np.concatenate([np.reshape(one.point, (1, 3)), np.concatenate(points)[away < near]])


def _telling(shown: list[tuple[str, Miss]]) -> list[tuple[str, Miss]]:
    """Misses in the order in which they deserve a picture: each detector's worst of each pair, then its second, ..."""
    worst = sorted(shown, key=lambda one: (one[1].kind != NEVER_FOUND, -one[1].cut_length, one[1].number))
    turn: defaultdict[tuple[str, int], Iterator[int]] = defaultdict(count)
    return sorted(worst, key=lambda one: next(turn[one[0], one[1].pair]))


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
