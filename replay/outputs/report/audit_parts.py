"""Parts of the report that only an audit has: counts, causes, step rates."""

from typing import Final

from replay.outputs.report.markup import Markup, element, joined, page_table, table
from replay.outputs.run_tables import matched_table, pair_frame_table
from replay.outputs.words import CONTACT_WORDS
from replay.pipeline.run_result import RunResult

FRAME_WORDS: Final = (
    "A pair-frame is one pair of bodies in one frame. Missed: the oracle says contact, the detector does not; "
    "false: the other way round. Within tolerance: they disagree about less than any tracker resolves. Left out: "
    "one of them could not decide, or a pose was lost. Between frames: only the way from frame to frame shows it."
)
CONTACT_NOTE: Final = (
    "A contact lasts from the first frame in which a pair touches to the last. The detector's are matched one to one "
    "with the oracle's, by most frames in common. Ties, not counted: undecided, within tolerance, or between frames."
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


def duration_table(result: RunResult) -> Markup | None:
    """Which step rate would have missed how many of the contacts."""
    steps = result.summary.get("dwell")
    if not steps or not steps["contacts"]:
        return None
    each = zip(steps["rates_hz"], steps["missed_at_this_phase"], steps["expected_misses"], strict=True)
    rows = [(f"{rate:g} Hz", str(now), f"{mean:.2f}") for rate, now, mean in each]
    safe = steps["none_missed_from_hz"]
    rows.append(("none is missed from", "", "no rate" if safe is None else f"{safe:.1f} Hz"))
    title = f"Contacts of {steps['contacts']} that looks at fixed steps miss, at frames of this recording"
    return table(title, ("step rate", "missed at this run's phase", "missed, mean over phases"), rows)
