"""Headline, list and notes say what the audit says, by the same numbers."""

from dataclasses import replace

from support.small_tables import made

from replay.comparison.clusters import MANY, clusters
from replay.comparison.outcome import Outcome
from replay.outputs.palette import MISSED, PARTLY_MISSED
from replay.outputs.rerun_log.columns import packed
from replay.outputs.rerun_log.focus import moments, read_misses
from replay.outputs.rerun_log.report import report_text
from replay.outputs.tables import markdown
from replay.pipeline.headline import headlines, price

SUBJECT = "22.5Hz"


def test_the_list_has_each_miss_at_its_deepest_frame(demo, read):
    rows = read.column("report/missed", "TextLog:text")
    listed = {int(row[2][0].split()[0]): row for row in rows}
    assert sorted(listed) == [miss.number for miss in demo.misses[SUBJECT]]
    for miss in demo.misses[SUBJECT]:
        row = listed[miss.number]
        frames, name = len(range(miss.first, miss.last + 1)), f"{miss.body_a}-{miss.body_b}"
        assert row[2][0].split()[1:6] == [f"{miss.seconds:.2f}", "s", str(frames), "fr", name]
        assert row[1] == miss.deepest and miss.kind in row[2][0] and row[2][0].endswith(miss.cause)


def test_whole_misses_are_red_and_partial_ones_paler(demo, read):
    words = [row[2][0] for row in read.column("report/missed", "TextLog:text")]
    colours = [row[2][0] for row in read.column("report/missed", "TextLog:color")]
    whole, part = packed([MISSED, PARTLY_MISSED]).tolist()
    assert colours == [whole if "never found" in word else part for word in words]
    assert {whole, part} == set(colours)


def test_the_note_where_the_cursor_meets_a_miss_is_about_that_miss(demo, read, recording):
    count = len(demo.misses[SUBJECT])
    places = {place.number: place.session_ns for place in read_misses(recording)}
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
    assert "Exact about the recorded poses" in text
    assert "rod-hand" in text


def test_the_longest_cuts_come_first(demo, read):
    text = read.column("report/longest_cuts", "TextDocument:text")[0][2][0]
    numbers = [int(line.split("**")[1]) for line in text.splitlines() if line.startswith("| **")]
    cuts = {miss.number: miss for miss in demo.misses[SUBJECT]}
    lengths = [cuts[number].cut_length for number in numbers]
    assert lengths == sorted(lengths, reverse=True)
    assert len(numbers) == min(40, len(cuts))


def test_a_run_that_missed_nothing_says_so(demo, write):
    seen = write(replace(demo, misses={SUBJECT: ()}))
    assert seen.column("report/missed", "TextLog:text")[0][2] == ["nothing missed by 22.5Hz"]


def test_a_miss_between_frames_says_when_and_which_faces_touch_first(passed, passed_read):
    (miss,) = passed.misses["exact"]
    assert miss.touch is not None
    moment = 10_000_000 * miss.touch.frame + miss.touch.later_ns
    ((ns, frame, words),) = passed_read.column("report/missed", "TextLog:text")
    assert (ns, frame) == (moment, 1) and "between frames" in words[0] and "0.01 s" in words[0]
    note = passed_read.at_ns("report/nearest_miss", "TextDocument:text", moment)[0]
    assert "between frames 1 and 2, from 0.01333" in note and "no frame shows it" in note
    assert f"first faces {miss.touch.faces[0]} of a and {miss.touch.faces[1]} of b" in note
    text = passed_read.column("report/longest_cuts", "TextDocument:text")[0][2][0]
    assert text.lstrip().startswith("### 1 missed between frames"), text
    assert text.splitlines()[4].endswith("| a - b | never found | 1 |") and "cut mm" not in text


def test_hundreds_of_misses_are_a_line_per_cluster_at_its_deepest_moment(hundreds):
    result, read = hundreds
    misses = result.misses[SUBJECT]
    assert len(misses) > 2 * MANY
    rows = read.column("report/clusters", "TextLog:text")
    assert 1 < len(rows) <= MANY and sum(int(row[2][0].split()[0]) for row in rows) == len(misses)
    at, found = moments(misses), {cluster.deepest.number: cluster for cluster in clusters(misses)}
    for _, frame, words in rows:
        number = int(words[0].rpartition("(miss ")[2].rstrip(")"))
        assert frame == at[number][0] and f"{len(found[number].misses)} x" in words[0]
    assert len(read.column("report/missed", "TextLog:text")) == len(misses), "and every miss keeps its line"


def test_the_words_beside_hundreds_begin_with_the_clusters_deepest_first(hundreds):
    result, read = hundreds
    text = read.column("report/longest_cuts", "TextDocument:text")[0][2][0]
    clusters_, longest = text.split("### The ")
    assert f"### {len(result.misses[SUBJECT])} misses of {SUBJECT} in" in clusters_ and longest.startswith(
        f"{MANY} longest of "
    )
    cuts = [float(line.split("|")[-2]) for line in clusters_.splitlines() if "**" in line]
    assert len(cuts) > 1 and cuts == sorted(cuts, reverse=True)


def test_markdown_escapes_what_would_end_a_cell():
    assert markdown(made(), level=2).splitlines() == [
        "## a title", "", "| body | count | mark |", "|---|---|---|", "| cup\\|lid | 1,234 | **7** |",
        "| rod | 0 | `x` |", "", "a note",
    ]  # fmt: skip
