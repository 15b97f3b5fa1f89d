import base64
import re
from dataclasses import replace
from html import escape

from replay.outputs.report.page import report_html
from replay.outputs.report.tradeoff import tradeoff_section
from replay.outputs.report.tradeoff_picture import DARK, LIGHT
from replay.outputs.tradeoff_table import AT_PHASE
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff


def test_the_page_holds_the_curve_the_advice_and_a_row_per_setting(run):
    tried = [Setting("hybrid", "as it comes", ""), Setting("discrete", "step rate", "20 Hz", {"rate_hz": 20.0})]
    done = replace(tradeoff(run.session, settings=tried, repeats=1), cut=("image-space",))
    part = str(tradeoff_section(done))
    assert (
        "data:image/svg+xml;base64," in part
        and "<summary>1 setting not tried, for want of time</summary><p>image-space.</p>" in part
    )
    themes = [base64.b64decode(one).decode().upper() for one in re.findall(r"svg\+xml;base64,([^\"]+)", part)]
    assert [[theme.grid in one for theme in (DARK, LIGHT)] for one in themes] == [[True, False], [False, True]]
    assert part.index("(prefers-color-scheme: dark)") < part.index("<img")
    for sentence in done.advice:
        assert sentence in part
    # that it does is shown where a sweep's misses are held against an audit's
    assert escape(AT_PHASE) in part
    assert part.count("<tr") == 1 + len(tried)
    hybrid = next(row for row in done.rows if row["detector"] == "hybrid")
    counted = [f">{count} {name.replace('_', ' ')}<" for name, count in hybrid["work"].items() if count]
    assert any(one in part for one in counted) and "skipped" not in part and done.about["machine"]["processor"] in part
    page = report_html(replace(run, tradeoff=done))
    assert part in page and "What accuracy costs" in page and "What accuracy costs" not in report_html(run)
    assert "<h1>What accuracy costs: 2 settings tried" in page and page.index(part) < page.index("When: slow")
