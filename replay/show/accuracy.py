"""Accuracy against cost: the loss of each detector over its mean time of a frame, one plot for page and picture."""

from collections.abc import Sequence
from dataclasses import replace

from replay import words
from replay.document.ranking import Rank, ranks_with_fixes
from replay.document.run_result import Summarised, Tradeoff
from replay.show.plots import Axis, Dot, Plot, Size, scatter, ticks_of

CHART_TITLE = "Accuracy against cost"

LOSS_AXIS = "loss = contacts missed + time missed + time false; 0 is right"
"""Title of the axis of losses."""

LEAST_AXIS_LOSS = 0.1
"""The axis of losses reaches up to this at least: where all are right, dots stand on the floor of a plot."""


def run_dots(result: Summarised) -> list[Dot]:
    """A dot for each detector of a ranking whose time was measured and that left no contact undecided, and its Fix.

    The worst one has the kind of its larger fault, ``false`` or ``missed``; the reference is a ``reference``.
    """
    audits = result.document.audit
    if all(audit.undecided.value == 1 for audit in audits.values()):
        return []
    dots = []
    for rank_number, rank in enumerate(ranks_with_fixes(result.ranking, result.document)):
        if rank.mean is not None and not rank.undecided:
            dots.append(Dot(rank.label, 1e3 * rank.mean, rank.loss, _kind(rank, worst=rank_number == 0), rank.label))
    return [_with_loss(dot) for dot in dots]


def _kind(rank: Rank, worst: bool) -> str:
    if rank.missed is None:
        return "reference"
    if not (worst and rank.loss):
        return ""
    return "false" if rank.leads_false else "missed"


def tradeoff_dots(tradeoff: Tradeoff) -> list[Dot]:
    """A dot for each setting that was tried; those on the front come first, so that they find room for their names."""
    rows = sorted(tradeoff.rows, key=lambda row: not row["front"])
    return [_with_loss(Dot(row["label"], row["mean_ms"], row["loss"], "front" if row["front"] else "")) for row in rows]


def _with_loss(dot: Dot) -> Dot:
    return replace(dot, name=f"{dot.name}: {words.loss_number(dot.y)}")


def accuracy_plot(dots: Sequence[Dot], size: Size, up_title: str = LOSS_AXIS) -> Plot:
    """Losses over milliseconds a frame."""
    largest = max([LEAST_AXIS_LOSS, *(dot.y for dot in dots)])
    loss_axis = Axis(up_title, ticks_of(largest, 3))
    dots_text = ", ".join(f"{dot.name} at {words.frame_time(dot.x / 1e3)} a frame" for dot in dots)
    return scatter(dots, f"{CHART_TITLE}, as losses: {dots_text}", "mean ms a frame", loss_axis, size)
