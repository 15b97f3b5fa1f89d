import re
from dataclasses import replace

import numpy as np
import pytest
from support.page_cells import Cells
from support.planted_faults import FAULTS, clean
from support.small_worlds import cubes

from replay.comparison.outcome import Outcome
from replay.effects.effect_summary import happened_words
from replay.outputs.report.audit_parts import BINS, dwell_table, latency_histogram
from replay.outputs.report.page import report_html
from replay.outputs.report.tables import EVENT_ROWS, effect_section, finding_tables, trust
from replay.pipeline.engine import compute
from replay.pipeline.summary import frame_seconds
from sessions import Finding, Severity
from sessions.model.scene import Scene, SceneBody, SceneEffect


@pytest.fixture(scope="module")
def doubtful():
    draft = clean()
    FAULTS["frozen pose"](draft, 1, 300)
    FAULTS["nan position"](draft, 0, 500)
    return compute(
        draft.session(), detectors="sphere", oracle="none", policy=["frozen=interpolate:2", "not-finite=drop"]
    )


def test_the_section_lists_findings_what_was_done_and_which_verdicts_rest_on_it(doubtful):
    text = finding_tables(doubtful)
    assert "1 error and 2 warnings" in text
    row = text[text.index('<td class="word">frozen</td><td class="word">hand-left</td>') :].split("</tr>")[0]
    assert "nothing was measured" in text and "3.333 to 3.989" in row
    done = text[text.index("What was done") :]
    assert 'interpolate:2</td><td class="number">1</td><td class="number">60</td>' in done
    stated = doubtful.summary["flagged_verdicts"]["sphere"]
    assert all(f"{count:,} {verdict}" in done for verdict, count in stated.items())


def test_the_page_asks_whether_the_recording_can_be_trusted(doubtful):
    page = report_html(doubtful)
    assert "Can the recording be trusted?" in page and str(finding_tables(doubtful)) in page


def test_words_of_a_recording_are_escaped(doubtful):
    odd = Finding("proxy", Severity.NOTE, "<b>", "<script>")
    treatment = replace(doubtful.treatment, findings=(odd,))
    assert "<script>" not in finding_tables(replace(doubtful, treatment=treatment))


def test_notes_alone_leave_a_recording_trusted_and_no_examination_is_said():
    assert trust((Finding("proxy", Severity.NOTE, "x"),)).startswith("Nothing was found")
    result = compute(clean().session(), detectors="sphere", oracle="none")
    assert "Nothing was found" in finding_tables(result)
    assert "not examined" in finding_tables(replace(result, treatment=None))


def test_what_a_code_means_is_said_once(doubtful):
    lost = [Finding("tracking-lost", Severity.WARNING, f"loss {k}") for k in range(9)]
    odd = Finding("frozen", Severity.WARNING, "still")
    treatment = replace(doubtful.treatment, findings=(*lost[:5], odd, *lost[5:]))
    text = finding_tables(replace(doubtful, treatment=treatment))
    assert text.count(f"{lost[0].meaning}; {lost[0].fix}") == text.count(f"{odd.meaning}; {odd.fix}") == 1
    assert [text.count(f"loss {k}") for k in range(9)] == [1] * 9
    assert text.index(lost[0].meaning) < text.index("loss 1")


def test_counts_in_the_page_are_those_of_the_summary(run, page):
    tables = Cells(page).tables
    figures = run.summary["audit"]["slow"]
    frames = dict(tables["Pair-frames"])
    assert int(frames["missed"]) == figures["pair_frames"]["MISSED"] > 0
    assert frames["between frames"] == "not examined"
    contacts = dict(tables["Contacts matched one to one"])
    words = {"truth": "contacts by the oracle", "found": "contacts reported", "missed": "missed whole"}
    words |= {"matched": "matched", "invented": "invented", "split": "by the oracle, reported in pieces"}
    for name, told in words.items():
        assert int(contacts[told]) == figures["episodes"][name]
    of_oracle = ("matched", "missed whole", "found only as part of a longer one", "by the oracle, nobody's fault")
    assert sum(int(contacts[told]) for told in of_oracle) == int(contacts["contacts by the oracle"])
    reported = ("matched", "invented", "further pieces of one contact", "reported, nobody's fault")
    assert sum(int(contacts[told]) for told in reported) == int(contacts["contacts reported"])


def test_the_map_of_pairs_adds_up_to_the_pair_frames(run, page):
    (rows,) = [rows for caption, rows in Cells(page).tables.items() if caption.startswith("Pair-frames missed of")]
    missed = sum(int(row[1].split(" of ")[0]) for row in rows)
    assert missed == run.comparisons["slow"].count(Outcome.MISSED)
    assert re.search(r'class="heat" style="background:rgba\(255,45,85,0\.\d+\)"', page)


def test_causes_in_the_page_are_those_counted(run, page):
    rows = dict(Cells(page).tables["Causes: misses (pair-frames decided again)"])
    told = run.causes["slow"]
    assert rows["between looks"] == f"{len(run.misses['slow'])} ({told.examined})"
    assert set(rows) == {"between looks", "decided again, of pair-frames missed"}


def test_every_frame_is_in_the_histogram(run, page):
    svg = str(latency_histogram(run))
    counted = [int(count) for count in re.findall(r"<title>(\d+) frames of", svg)]
    assert sum(counted) == len(frame_seconds(run.detections["slow"])) and 1 <= len(counted) <= BINS
    assert svg in page
    assert not latency_histogram(compute(run.session, detectors="hybrid"))


def test_step_rates_in_the_page_are_those_of_the_summary(run, page):
    rows = dict(next(rows for caption, rows in Cells(page).tables.items() if "look at fixed steps misses" in caption))
    told = run.summary["dwell"]
    assert np.allclose(float(rows["90 Hz"]), told["expected_misses"][told["rates_hz"].index(90.0)], atol=0.005)
    assert rows["none is missed from"] == f"{told['none_missed_from_hz']:.1f} Hz"
    assert dwell_table(compute(run.session, detectors="hybrid", oracle="none")) is None


BETWEEN = {"between": ["a", "b"]}


def run(places, *effects):
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b")), effects=effects)
    return compute(cubes({"a": [0.0] * len(places), "b": places}, scene=scene), detectors=())


@pytest.fixture(scope="module")
def result():
    places = [3.0] * 8 + [0.9] * 4 + [3.0] * 4
    return run(places, SceneEffect("breakage", {**BETWEEN, "speed_m_s": 1.0}), SceneEffect("penetration"))


def test_the_page_says_what_ran_why_at_what_price_and_what_did_not(result):
    page = report_html(result)
    for words in (
        "Effects that the scene calls for", "breakage needs it", "% of the run", "% skipped", "the begin of a contact",
        "Not called for, so not imported and not run: ", "Declared, and not computed by this version: penetration.",
    ):  # fmt: skip
        assert words in page, words
    assert "No collision query was made." not in page


def test_events_stand_in_order_of_time_and_a_long_list_is_cut_and_says_so():
    flicker = run(([0.9] * 2 + [3.0] * 2) * (EVENT_ROWS + 5), SceneEffect("contact", BETWEEN))
    section = effect_section(flicker)
    assert (
        f"the first {EVENT_ROWS} of {EVENT_ROWS + 5}" in section
        and section.count('<td class="word">contact a - b') == EVENT_ROWS
    )


def test_a_run_without_a_contact_says_that_none_was_looked_for():
    page = report_html(
        run([3.0, 3.0, 1.1, 3.0], SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 0.2}))
    )
    assert "No collision query was made." in page and "mm of b" in page


def test_a_page_without_effects_has_no_such_section():
    assert "Effects that the scene" not in report_html(compute(cubes({"a": [0, 0], "b": [3, 0.9]}), detectors="hybrid"))


def test_without_a_detector_the_page_begins_with_what_happened():
    near = SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 0.2})
    result = run([3.0] * 20 + [1.1] + [3.0] * 40 + [1.1, 3.0], near)
    page = report_html(result)
    first = page[: page.index("</header>")]
    one, two = happened_words(result.effects, 5)
    assert f"<h1>2 {result.effects['hazard-proximity'].events[0].name}</h1>" in first
    assert first.index(one) < first.index(two) < first.index("No contact was looked for")
