from replay.outputs.tradeoff_table import HEAD, quickest_first, tradeoff_table

ROW = {
    "label": "a", "oracle": False, "front": True, "front_online": True, "ms_per_frame": 0.5, "ms_high": 0.75,
    "p99_ms": 1.25, "over_share": 0.02, "seconds_per_minute": 2.7, "missed": 0.1, "missed_low": 0.05,
    "missed_high": 0.2, "precision": 0.75, "face_recall": None, "work": {"tests": 12_345, "skipped": 99_999},
}  # fmt: skip


def test_shares_are_percentages_and_what_was_not_measured_is_empty():
    (row,) = tradeoff_table("", [ROW]).rows
    assert dict(zip(HEAD, row, strict=True)) == {
        "#": "1", "setting": "a", "front": "front, live front", "ms per frame": "0.5000", "slowest": "0.7500",
        "p99 ms (over 11.1)": "1.250 (2 %)", "s per minute": "2.70", "missed, % [95 %]": "10 [5, 20]",
        "invented, %": "25", "faces, %": "", "most of its work": "12k tests",
    }  # fmt: skip


def test_rows_are_numbered_in_the_order_given():
    slow = {**ROW, "label": "b", "ms_per_frame": 2.0, "p99_ms": None, "precision": None, "work": {}}
    rows = tradeoff_table("", quickest_first([slow, ROW])).rows
    assert [row[:2] for row in rows] == [("1", "a"), ("2", "b")] and rows[1][-1] == rows[1][5] == rows[1][8] == ""


def test_a_share_that_is_not_zero_is_not_shown_as_zero():
    few = {"missed": 1 / 9000, "missed_low": 1 / 90000, "missed_high": 4 / 9000, "precision": 8999 / 9000}
    (row,) = tradeoff_table("", [{**ROW, **few, "over_share": 1 / 81000}]).rows
    cells = dict(zip(HEAD, row, strict=True))
    assert cells["missed, % [95 %]"] == "0.011 [0.0011, 0.044]" and cells["invented, %"] == "0.011"
    assert cells["p99 ms (over 11.1)"] == "1.250 (0.0012 %)"
