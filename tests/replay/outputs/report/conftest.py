"""One small run with misses, and its page."""

import pytest

from replay.outputs.report.page import report_html
from replay.pipeline.engine import compute
from sessions.synthetic.analytic import make_analytic


@pytest.fixture(scope="session")
def run():
    session, _ = make_analytic("fast-ball", seed=1)
    return compute(session, detectors="slow=discrete[rate_hz=22.5]")


@pytest.fixture(scope="session")
def page(run):
    return report_html(run)
