"""Headline, list and notes say what the audit says, by the same numbers."""

from dataclasses import replace

from support.small_tables import made

from replay.base.constants import CAVEAT
from replay.comparison.clusters import MANY, clusters
from replay.comparison.outcome import Outcome
from replay.outputs.moments import key_moments
from replay.outputs.palette import MISSED, PARTLY_MISSED
from replay.outputs.rerun_log.columns import packed
from replay.outputs.rerun_log.overview import read_moments
from replay.outputs.rerun_log.report import report_text
from replay.outputs.tables import markdown
from replay.pipeline.headline import headlines, price

SUBJECT = "22.5Hz"


def test_the_list_has_each_miss_at_its_deepest_frame(demo, read):
    rows = read.column("report/missed", "TextLog:text")
    listed = {int(row[2][0].split()[2]): row for row in rows}
    assert sorted(listed) == [miss.number for miss in demo.misses[SUBJECT]]
    for miss in demo.misses[SUBJECT]:
        row = listed[miss.number]
        words = row[2][0].split()
        assert row[1] == miss.deepest
        assert f"{miss.body_a}-{miss.body_b}" in words and words[:2] == [SUBJECT, "miss"]
        assert row[2][0].endswith(f"  {miss.cause}") and miss.kind in row[2][0]


def test_whole_misses_are_red_and_partial_ones_paler(demo, read):
    words = [row[2][0] for row in read.column("report/missed", "TextLog:text")]
    colours = [row[2][0] for row in read.column("report/missed", "TextLog:color")]
    whole, part = packed([MISSED, PARTLY_MISSED]).tolist()
    assert colours == [whole if "never found" in word else part for word in words]
    assert {whole, part} == set(colours)


def test_the_note_where_the_cursor_meets_a_miss_is_about_that_miss(demo, read, recording):
    count = len(demo.misses[SUBJECT])
    places = {one.number: one.session_ns for one in read_moments(recording) if one.kind == "miss"}
    for miss in demo.misses[SUBJECT]:
        text = read.at_ns("report/nearest_miss", "TextDocument:text", places[miss.number])[0]
        assert f"Miss {miss.number} of {count}: {miss.body_a}-{miss.body_b}" in text
        assert f"--miss {miss.number} --by {SUBJECT}`" in text


def test_the_report_gives_the_counts_of_the_comparison(demo, read):
    text = read.column("report", "TextDocument:text")[0][2][0]
    assert text == report_text(demo)
    assert all(line in text for line in (*headlines(demo), *price(demo))) and len(headlines(demo)) == 1
    comparison = demo.comparisons[SUBJECT]
    assert f"| {comparison.count(Outcome.BOTH):,} | {comparison.count(Outcome.MISSED):,} |" in text
    assert CAVEAT in text
    assert "rod-hand" in text


def test_a_run_that_missed_nothing_says_so(demo, write):
    seen = write(replace(demo, misses={SUBJECT: ()}))
    assert seen.column("report/missed", "TextLog:text")[0][2] == ["nothing missed by 22.5Hz"]


def test_a_miss_between_frames_says_when_and_which_faces_touch_first(passed, passed_read):
    (miss,) = passed.misses["exact"]
    assert miss.touch is not None
    moment = 10_000_000 * miss.touch.frame + miss.touch.later_ns
    ((ns, frame, words),) = passed_read.column("report/missed", "TextLog:text")
    assert (ns, frame) == (moment, 1) and words[0].endswith("between frames")
    note = passed_read.at_ns("report/nearest_miss", "TextDocument:text", moment)[0]
    assert "between frames 1 and 2, from 0.01333" in note and "no frame shows it" in note
    assert f"first faces {miss.touch.faces[0]} of a and {miss.touch.faces[1]} of b" in note


def test_hundreds_of_misses_are_a_line_per_cluster_at_its_deepest_moment(hundreds):
    result, read = hundreds
    misses = result.misses[SUBJECT]
    assert len(misses) > 2 * MANY
    rows = read.column("report/clusters", "TextLog:text")
    assert 1 < len(rows) <= MANY and sum(int(row[2][0].split()[0]) for row in rows) == len(misses)
    at, found = (
        {one.number: one for one in key_moments(result) if one.outcome == Outcome.MISSED},
        {cluster.deepest.number: cluster for cluster in clusters(misses)},
    )
    for _, frame, words in rows:
        number = int(words[0].rpartition("(miss ")[2].rstrip(")"))
        assert frame == at[number].frame and f"{len(found[number].misses)} x" in words[0]
    assert len(read.column("report/missed", "TextLog:text")) == len(misses), "and every miss keeps its line"


def test_markdown_escapes_what_would_end_a_cell():
    assert markdown(made(), level=2).splitlines() == [
        "## a title", "", "| body | count | mark |", "|---|---|---|", "| cup\\|lid | 1,234 | **7** |",
        "| rod | 0 | `x` |", "", "a note",
    ]  # fmt: skip
