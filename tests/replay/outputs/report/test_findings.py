from dataclasses import replace

import pytest
from support.planted_faults import FAULTS, clean

from replay.outputs.report.markup import rendered
from replay.outputs.report.page import report_html
from replay.outputs.report.tables import finding_parts
from replay.pipeline.engine import compute
from sessions import Finding, Severity


def finding_text(result):
    return "\n".join(map(rendered, finding_parts(result)))


@pytest.fixture(scope="module")
def doubtful():
    draft = clean()
    FAULTS["frozen pose"](draft, 1, 300)
    FAULTS["nan position"](draft, 0, 500)
    return compute(
        draft.session(), detectors="sphere", oracle="none", policy=["frozen=interpolate:2", "not-finite=drop"]
    )


def test_the_section_lists_findings_what_was_done_and_which_verdicts_rest_on_it(doubtful):
    text = finding_text(doubtful)
    assert "1 error and 2 warnings" in text
    row = text[text.index('<td class="word">frozen</td><td class="word">hand-left</td>') :].split("</tr>")[0]
    assert "nothing was measured" in text and "3.333 to 3.989" in row
    done = text[text.index("What was done") :]
    assert 'interpolate:2</td><td class="number">1</td><td class="number">60</td>' in done
    stated = doubtful.summary["flagged_verdicts"]["sphere"]
    assert all(f"{count:,} {verdict}" in done for verdict, count in stated.items())


def test_the_page_asks_whether_the_recording_can_be_trusted(doubtful):
    page = report_html(doubtful)
    assert "What is suspicious about the recording" in page and finding_text(doubtful) in page


def test_words_of_a_recording_are_escaped(doubtful):
    odd = Finding("proxy", Severity.NOTE, "<b>", "<script>")
    treatment = replace(doubtful.treatment, findings=(odd,))
    assert "<script>" not in finding_text(replace(doubtful, treatment=treatment))
