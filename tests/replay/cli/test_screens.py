"""What a terminal shows of a run, whole, as a person has read it: in every state, and in windows of every width."""

import io
import re
from copy import deepcopy
from dataclasses import replace
from functools import cache

import pytest
from rich.console import Console
from support.report_states import STATES
from support.small_worlds import cubes

from replay.cli.run_tables import run_screen
from replay.pipeline.engine import compute
from replay.pipeline.ranking import ranking
from sessions.model.event import LiveContact

SEE_IT = ("See it   replay view runs/demo --miss 1", "Read it  runs/demo/report.html   (-v prints every table here)")


@cache
def steady(state, mean=4e-5):
    """A run whose times are the same on every machine: 0.04 ms a frame, 0.1 ms in 99 of 100, nothing else at work."""
    result = STATES[state]() if state in STATES else compute(reported(state))
    summary = deepcopy(result.summary)
    for figures in summary["detectors"].values():
        figures["seconds"] |= {"per_frame_mean": mean, "processor_share": 1.0}
        figures["seconds"]["per_frame"] = figures["seconds"].get("per_frame", {}) | {"p99": 2.5 * mean}
    answers = [replace(answer, fix=answer.fix and timeless(answer.fix)) for answer in result.answers]
    ranks = ranking(summary) if result.ranking else ()
    return replace(result, summary=summary, ranking=ranks, answers=tuple(answers))


def timeless(fix):
    return replace(fix, words=re.sub(r"[\d.]+ ms a frame", "0.05 ms a frame", fix.words))


def reported(state):
    session = cubes({"a": [0.0] * 12, "b": [3, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3, 3, 3, 3]})
    if state == "unasked":
        return session
    return replace(
        session, live_contacts=(LiveContact(0, "a", "b", "enter"), LiveContact(30_000_000, "a", "b", "exit"))
    )


def printed(part, width):
    stream = io.StringIO()
    Console(file=stream, width=width).print(part)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines())


@pytest.mark.parametrize("state", sorted(STATES.keys() - {"effects"}))  # its table is of times
def test_the_screen_of_80_columns_reads_as_it_did(state, snapshot):
    assert printed(run_screen(steady(state), SEE_IT), 80) == snapshot


def test_the_ranking_of_five_detectors_one_of_them_the_engine_itself_is_one_table_of_80_columns(snapshot):
    shown = printed(run_screen(steady("unasked, with reports of an engine"), SEE_IT), 80)
    assert shown == snapshot and shown.count("mesh50") == 1


def test_the_times_of_quick_detectors_leave_a_line_of_80_columns():
    shown = printed(run_screen(steady("unasked", 9.5e-6), SEE_IT), 100)
    assert "0.009" in shown and max(map(len, shown.splitlines())) <= 80
