"""Screens of a run, whole, as a person has read them: in every state, and in windows of every width."""

import io

import pytest
from rich.console import Console
from support.report_states import RUN_OF_STATE, run_with_steady_times

from replay.cli.run_tables import run_screen, run_tables

TABLED = (
    "several", "nine pairs", "effects beside an audit", "no reference", "inside undecided", "not live", "offline",
)  # fmt: skip
SEE_IT = ("See it   replay view runs/demo --miss 1", "Read it  runs/demo/report.html   (-v prints every table here)")


def terminal_text(displayed, width):
    """Text of what is displayed on a terminal of this width."""
    stream = io.StringIO()
    Console(file=stream, width=width).print(displayed)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines())


@pytest.mark.parametrize("state", RUN_OF_STATE)
def test_the_screen_of_80_columns_reads_as_it_did(state, snapshot):
    """``state``: in which a run may end; what `replay run` prints of it last, with times that do not vary.

    Expected is the text that is stored beside this file, which a person has read.
    """
    assert terminal_text(run_screen(run_with_steady_times(state), SEE_IT), width=80) == snapshot


@pytest.mark.parametrize("state", TABLED)
def test_every_table_of_a_run_reads_as_it_did(state, snapshot):
    """``state``: in which a run may end, of those whose tables differ; `replay run -v` prints them in 120 columns.

    Expected is the text that is stored beside this file, which a person has read.
    """
    assert terminal_text(run_tables(run_with_steady_times(state)), width=120) == snapshot


def test_ranking_of_five_detectors_fits_80_columns(snapshot):
    """Default detectors, and contacts that an engine reported: each is one row, as the label mesh50 occurs once."""
    run = run_with_steady_times("unasked, with reports of an engine")
    displayed = terminal_text(run_screen(run, SEE_IT), width=80)
    assert displayed == snapshot
    assert displayed.count("mesh50") == 1


def test_times_of_quick_detectors_fit_80_columns():
    """Default detectors take 9.5 us a frame, written as 0.0095 ms; the terminal has 100 columns, but 80 are enough."""
    displayed = terminal_text(run_screen(run_with_steady_times("unasked", 9.5e-6), SEE_IT), width=100)
    assert "0.0095" in displayed
    assert max(map(len, displayed.splitlines())) <= 80
