"""What accuracy costs: the picture of the report, and what to take."""

from __future__ import annotations

from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb

from replay.outputs.price_plot import subtitle
from replay.outputs.report.drawing import DARK
from replay.outputs.report.tradeoff_picture import picture
from replay.outputs.rerun_log.columns import RecordingWriter
from replay.outputs.rerun_log.views import PLAIN, text_view
from replay.outputs.tables import markdown
from replay.outputs.tradeoff_table import SHOWN, how_measured, tradeoff_table
from replay.pipeline.run_result import Tradeoff

PLOTS: Final = "tradeoff/plots"
ADVICE: Final = "tradeoff/advice"
TAB: Final = "What accuracy costs"


def log_tradeoff(writer: RecordingWriter, done: Tradeoff) -> None:
    """Send picture and words."""
    drawn = picture(done, "png", DARK, beside_words=True)
    writer.static(PLOTS, rr.EncodedImage(contents=drawn, media_type="image/png"))
    writer.markdown(ADVICE, advice_text(done))


def curve_tab() -> Any:
    """Wrong contacts against time, and what to take."""
    plots = rrb.Spatial2DView(origin=f"/{PLOTS}", name="Wrong contacts against time", background=PLAIN)
    return rrb.Horizontal(plots, text_view(ADVICE, "What to take"), column_shares=[0.72, 0.28], name=TAB)


def advice_text(done: Tradeoff) -> str:
    """The answer, the advice, how it was measured and the table of the front in Markdown, then every row."""
    front = tradeoff_table("The front", [row for row in done.rows if row["front"]]).only(*SHOWN)
    cut = [f"Not tried, for want of time: {', '.join(done.cut)}."] if done.cut else []
    whole = tradeoff_table("Every setting", done.rows).only(*SHOWN).titled("Every setting", *cut)
    advice = "\n\n".join([f"## {done.answer}", *subtitle(done), *(f"- {sentence}" for sentence in done.advice)])
    measured = "\n".join(f"- {sentence}" for sentence in how_measured(done))
    return "\n\n".join([advice, measured, markdown(front, level=2), markdown(whole, level=2)])
