from support.small_tables import made

from replay.outputs.rerun_log.markdown import markdown


def test_markdown_escapes_what_would_end_a_cell():
    assert markdown(made(), level=2).splitlines() == [
        "## a title", "", "| body | count | mark |", "|---|---|---|", "| cup\\|lid | 1,234 | **7** |",
        "| rod | 0 | `x` |", "", "a note",
    ]  # fmt: skip
