"""A column of the ranking is one row of one table: every output shows it, and Parquet holds its number."""

import re
from html import unescape
from io import StringIO

import pyarrow.parquet as pq
import pytest
from rich.console import Console
from support.report_states import steady

import replay
from replay.cli.run_markdown import run_markdown
from replay.cli.run_tables import run_screen
from replay.show import run_tables
from replay.show.rerun_log.documents import ranking_text
from replay.show.results.run_folder import write_run_folder
from replay.tables import Column

OUTPUTS = ("terminal", "Markdown", "report", "notebook", "picture")
NEW = Column("probe", float, of=lambda rank: 40.0 + len(rank.label), show=lambda value: f"probe-{value:.0f}")


def terminal_text(result):
    console = Console(width=200, file=StringIO())
    console.print(run_screen(result))
    return console.file.getvalue()


def texts_of(result, folder):
    notebook = replay.RunResult.of(result)
    return {
        "terminal": terminal_text(result),
        "Markdown": run_markdown(result, ()),
        "report": unescape((folder / "report.html").read_text(encoding="utf-8")),
        "notebook": repr(notebook) + notebook._repr_html_(),
        "picture": ranking_text(result),
    }


@pytest.fixture(scope="module")
def texts(tmp_path_factory):
    """A run, its folder, and its texts, once as they are and once with one more row in the table of columns."""
    result, folder = steady("several"), tmp_path_factory.mktemp("runs")
    before = texts_of(result, write_run_folder(result, folder / "before"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_tables, "RANKING", (*run_tables.RANKING, NEW))
        after = texts_of(result, write_run_folder(result, folder / "after"))
    return result, folder / "after", before, after


@pytest.mark.parametrize("output", OUTPUTS)
def test_a_new_column_is_displayed_after_a_single_edit(texts, output):
    result, _, before, after = texts
    cells = {f"probe-{40 + len(rank.label)}" for rank in result.ranking}
    assert cells <= set(re.findall(r"probe-\d+", after[output]))
    assert "probe" in after[output]
    assert "probe" not in before[output]


def test_a_new_column_is_a_column_in_parquet(texts):
    result, folder, *_ = texts
    rows = pq.read_table(folder / "ranking.parquet").to_pylist()
    assert {row["detector"]: row["probe"] for row in rows} == {
        rank.label: 40.0 + len(rank.label) for rank in result.ranking
    }


def test_parquet_holds_the_numbers_behind_the_cells(texts):
    result, folder, *_ = texts
    rows = {row["detector"]: row for row in pq.read_table(folder / "ranking.parquet").to_pylist()}
    for rank in result.ranking[:-1]:
        row = rows[rank.label]
        assert row["missed"] == pytest.approx(rank.missed.value * rank.contacts)
        assert row["late_or_cut_short"] == pytest.approx(rank.late_or_cut_short.value * rank.contacts)
        assert row["false_contact"] == rank.false.value
        assert row["mean_ms"] == pytest.approx(1e3 * rank.mean)
        assert row["loss"] == rank.loss
    assert rows[result.oracle]["missed"] is None


def test_every_column_of_the_ranking_has_a_meaning():
    assert all(column.meaning for column in run_tables.RANKING)
