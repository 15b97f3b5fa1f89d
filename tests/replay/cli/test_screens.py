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


def terminal_text(part, width):
    """Text of a part of a screen on a terminal of this width."""
    stream = io.StringIO()
    Console(file=stream, width=width).print(part)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines())


@pytest.mark.parametrize("state", RUN_OF_STATE)
def test_the_screen_of_80_columns_reads_as_it_did(state, snapshot):
    """Every state that a run may end in."""
    assert terminal_text(run_screen(run_with_steady_times(state), SEE_IT), width=80) == snapshot


@pytest.mark.parametrize("state", TABLED)
def test_every_table_of_a_run_reads_as_it_did(state, snapshot):
    """States whose tables differ, in 120 columns."""
    assert terminal_text(run_tables(run_with_steady_times(state)), width=120) == snapshot


def test_ranking_of_five_detectors_fits_80_columns(snapshot):
    """Detectors that nobody named, with contacts that an engine reported."""
    displayed = terminal_text(run_screen(run_with_steady_times("unasked, with reports of an engine"), SEE_IT), width=80)
    assert displayed == snapshot and displayed.count("mesh50") == 1


def test_times_of_quick_detectors_fit_80_columns():
    """9.5 us a frame are 0.0095 ms; the terminal has 100 columns."""
    displayed = terminal_text(run_screen(run_with_steady_times("unasked", 9.5e-6), SEE_IT), width=100)
    assert "0.0095" in displayed and max(map(len, displayed.splitlines())) <= 80
