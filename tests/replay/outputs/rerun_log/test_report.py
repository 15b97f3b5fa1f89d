"""Headline, list and notes say what the audit says, by the same numbers."""

from dataclasses import replace

from replay.outputs.rerun_log.overview import read_moments

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


def test_the_note_where_the_cursor_meets_a_miss_is_about_that_miss(demo, read, recording):
    count = len(demo.misses[SUBJECT])
    places = {one.number: one.session_ns for one in read_moments(recording) if one.kind == "miss"}
    for miss in demo.misses[SUBJECT]:
        text = read.at_ns("report/nearest_miss", "TextDocument:text", places[miss.number])[0]
        assert f"Miss {miss.number} of {count}: {miss.body_a}-{miss.body_b}" in text
        assert f"--miss {miss.number} --by {SUBJECT}`" in text


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
