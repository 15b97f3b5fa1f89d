"""Parts of the report that only an audit has: counts, causes, a map of the pairs, how long frames took, step rates."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.base.constants import BUDGET_MS, ONE_FRAME
from replay.comparison.outcome import Outcome
from replay.outputs.palette import MISSED, SERIES, hex_of
from replay.outputs.report.markup import Markup, bar, element, joined, page_table, table
from replay.outputs.run_tables import matched_table, pair_frame_table
from replay.outputs.words import CONTACT_WORDS
from replay.pipeline.run_result import RunResult
from replay.pipeline.summary import look_seconds

BINS: Final = 40
WIDTH, HEIGHT, LEFT, BOTTOM = 1100, 150, 190, 20
MOST_PAIRS: Final = 60

FRAME_WORDS: Final = (
    "A pair-frame is one pair of bodies in one frame. Missed: the oracle says contact, the detector does not; "
    "invented: the other way round. Within tolerance: they disagree about less than any tracker resolves. Left out: "
    "one of them could not decide, or a pose was lost. Between frames: only the way from frame to frame shows it."
)
CONTACT_NOTE: Final = (
    "A contact lasts from the first frame in which a pair touches to the last. The detector's are matched one to one "
    "with the oracle's, by most frames in common. Nobody's fault: undecided, within tolerance, or between frames."
)


def count_tables(result: RunResult) -> Markup:
    """Pair-frames and contacts of every audited detector, matched and unmatched."""
    audit = result.summary["audit"]
    frames = pair_frame_table("Pair-frames", audit)
    contacts = matched_table("Contacts matched one to one", audit, CONTACT_WORDS)
    return joined([element("p", FRAME_WORDS), page_table(frames), element("p", CONTACT_NOTE), page_table(contacts)])


def cause_table(result: RunResult) -> Markup:
    """Why contacts were missed: misses, and pair-frames decided again, by the stage that lost them."""
    audit = result.summary["audit"]
    causes_of = {label: audit[label]["causes"] for label in audit if "causes" in audit[label]}
    found = causes_of.values()
    rows = [
        (word, *(f"{one['misses'][word]} ({one['pair_frames'][word]})" for one in found))
        for word in dict.fromkeys(word for one in found for word in one["misses"])
        if any(one["misses"][word] or one["pair_frames"][word] for one in found)
    ]
    rows.append(("decided again, of pair-frames missed", *(f"{one['examined']} of {one['missed']}" for one in found)))
    return table("Causes: misses (pair-frames decided again)", ("cause", *causes_of), rows)


def heat_map(result: RunResult) -> Markup:
    """A row per pair and a column per detector: the share of contact that was missed, the redder the more."""
    outcomes = [one.outcome for one in result.comparisons.values()]
    missed = np.array([(one == Outcome.MISSED).sum(axis=0) for one in outcomes])
    of = missed + np.array([(one == Outcome.BOTH).sum(axis=0) for one in outcomes])
    touched = [pair for pair in np.argsort(-missed.max(axis=0), kind="stable").tolist() if of[:, pair].any()]
    rows = [
        (result.assembly.pair_name(pair), *map(_heat, missed[:, pair].tolist(), of[:, pair].tolist()))
        for pair in touched[:MOST_PAIRS]
    ]
    more = f" ({len(touched) - MOST_PAIRS} more in frames.parquet)" if len(touched) > MOST_PAIRS else ""
    return table(f"Pair-frames missed of those in contact, by pair{more}", ("pair", *result.comparisons), rows)


def latency_histogram(result: RunResult) -> Markup:
    """How many frames took how long, on a log axis, of every detector whose frames were timed, if there is one."""
    timed = ((label, look_seconds(found)) for label, found in result.detections.items())
    # A log axis has no place for 0 ms.
    shown = {label: np.maximum(one * 1e3, 1e-4) for label, one in timed if one is not None and len(one)}
    if not shown:
        return Markup()
    low = min(float(values.min()) for values in shown.values())
    high = max(BUDGET_MS * 1.5, *(float(values.max()) for values in shown.values()))
    edges = np.geomspace(low * 0.9, high * 1.1, BINS + 1)
    lanes = [_lane(label, values, edges, row) for row, (label, values) in enumerate(shown.items())]
    height = HEIGHT * len(shown) + BOTTOM
    x = _along(BUDGET_MS, edges)
    line = element("line", x1=f"{x:.1f}", x2=f"{x:.1f}", y1=0, y2=height - BOTTOM, class_="budget")
    ticks = [
        element("text", f"{value:g} ms", x=f"{_along(value, edges):.1f}", y=height - 5, class_="tick")
        for value in (0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
        if edges[0] <= value <= edges[-1]
    ]
    words = f"How many frames took how long; dashed: {ONE_FRAME}, {BUDGET_MS:.1f} ms"
    svg = element("svg", *lanes, line, *ticks, viewBox=f"0 0 {WIDTH} {height}", role="img", aria_label=words)
    return element("figure", svg, element("figcaption", f"{words}."))


def duration_table(result: RunResult) -> Markup | None:
    """Which step rate would have missed how many of the contacts."""
    steps = result.summary.get("dwell")
    if not steps or not steps["contacts"]:
        return None
    rows = [
        (f"{rate:g} Hz", str(now), f"{mean:.2f}")
        for rate, now, mean in zip(
            steps["rates_hz"], steps["missed_at_this_phase"], steps["expected_misses"], strict=True
        )
    ]
    safe = steps["none_missed_from_hz"]
    rows.append(("none is missed from", "", "no rate" if safe is None else f"{safe:.1f} Hz"))
    title = f"Contacts of {steps['contacts']} that looks at fixed steps miss, at frames of this recording"
    return table(title, ("step rate", "missed at this run's phase", "missed, mean over phases"), rows)


def _heat(missed: int, of: int) -> Markup:
    share = missed / of if of else 0.0
    red = ",".join(map(str, MISSED[:3]))
    return element("span", f"{missed} of {of}", class_="heat", style=f"background:rgba({red},{0.85 * share:.3f})")


def _lane(label: str, values: NDArray[np.float64], edges: NDArray[np.float64], row: int) -> Markup:
    count, _ = np.histogram(values, edges)
    top = HEIGHT * row
    p99 = float(np.quantile(values, 0.99))
    words = element("text", f"{label}: 99 % {p99:.3g} ms", x=0, y=top + 20, class_="lane")
    bars = []
    for k in np.flatnonzero(count).tolist():
        x, after = _along(float(edges[k]), edges), _along(float(edges[k + 1]), edges)
        tall = max(2.0, (HEIGHT - 10) * float(count[k]) / float(count.max()))
        hint = f"{count[k]} frames of {edges[k]:.3g} to {edges[k + 1]:.3g} ms"
        bars.append(bar(hint, x, top + HEIGHT - tall, after - x - 1, tall, fill=hex_of(SERIES[0])))
    return joined([words, *bars])


def _along(value: float, edges: NDArray[np.float64]) -> float:
    share = np.log(value / edges[0]) / np.log(edges[-1] / edges[0])
    return LEFT + (WIDTH - LEFT) * float(share)
