from replay.tradeoff.lines import lines_of


def test_points_of_one_algorithm_and_axis_are_one_line_in_order_of_time():
    rows = [{"line": name, "ms_per_frame": ms} for name, ms in (("a", 3.0), ("b", 1.0), ("a", 2.0))]
    assert lines_of(rows) == {
        "a": [{"line": "a", "ms_per_frame": 2.0}, {"line": "a", "ms_per_frame": 3.0}],
        "b": [{"line": "b", "ms_per_frame": 1.0}],
    }
    assert lines_of([]) == {}
