"""Losses are known by how the recordings here were made, never from the ledger itself."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.mutants import ledger_text

from sessions import examine, read_session, write_session
from sessions.importers import import_session
from sessions.importers.ledger import FACT, Ledger, ledger_of

COUNTS = st.integers(0, 10**6)
REASONS = st.dictionaries(st.sampled_from(["torn", "twice", "ragged"]), st.integers(1, 1000), max_size=3)


@given(st.lists(st.tuples(st.sampled_from(["rows", "samples"]), st.sampled_from("ab"), COUNTS, REASONS, REASONS)))
def test_accounts_add_up_and_come_back_from_text(accounts):
    """A ledger books random accounts: kind, body, rows kept, reason -> rows dropped, reason -> rows merged.

    It comes back whole from its text among the facts of a session; all rows booked are the rows read.
    """
    ledger = Ledger("log.csv")
    rows_booked = 0
    for kind, body, kept, dropped, merged in accounts:
        read = kept + sum(dropped.values()) + sum(merged.values())
        ledger.book(kind, body, read=read, kept=kept, dropped=dropped, merged=merged)
        rows_booked += read
    ledger_from_text = ledger_of({FACT: ledger.as_text()})
    assert list(ledger_from_text) == list(ledger)
    assert sum(entry.read for entry in ledger_from_text) == rows_booked


WRONG_SUMS = [
    pytest.param(3, 2, {}, "read 3, accounted for 2", id="3 are not 2"),
    pytest.param(3, 3, {"torn": 1}, "read 3, accounted for 4", id="3 are not 3 + 1"),
    pytest.param(2, 3, {"torn": -1}, "a count is negative", id="a negative count"),
]


@pytest.mark.parametrize(("read", "kept", "dropped", "fault"), WRONG_SUMS)
def test_account_with_wrong_sum_is_never_booked(read, kept, dropped, fault):
    """Rows read are those kept and those dropped, and no count is negative."""
    with pytest.raises(AssertionError, match=fault):
        Ledger("log").book("rows", read=read, kept=kept, dropped=dropped)


@pytest.mark.parametrize(("read", "kept", "dropped", "_fault"), WRONG_SUMS)
def test_text_of_account_with_wrong_sum_is_no_ledger(read, kept, dropped, _fault):
    """A session's facts have an account of rows of the whole recording (body ""), with nothing merged.

    Where 3 rows are 2 kept and 1 dropped, the same text is a ledger.
    """
    right_account, account = ["rows", "", 3, 2, {"torn": 1}, {}], ["rows", "", read, kept, dropped, {}]
    assert ledger_of({FACT: json.dumps([right_account])}) is not None
    assert ledger_of({FACT: json.dumps([account])}) is None


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("", id="nothing"),
        pytest.param("[", id="half a list"),
        pytest.param("{}x", id="no JSON"),
        pytest.param("3", id="a number"),
        pytest.param('[["rows"]]', id="half an account"),
        pytest.param('[["rows","",1,true,{},{}]]', id="a truth value for a count"),
        pytest.param('[["x","",1,1,{},{}]]', id="an unknown kind"),
        pytest.param("[" * 9999, id="nested too deeply"),
    ],
)
def test_malformed_import_ledger_is_read_as_absent(text):
    """A ledger is a JSON list of accounts: kind, body, rows read, rows kept, and what was dropped and merged, why."""
    assert ledger_of({FACT: text}) is None


HEAD = "time,body,px,py,pz,qx,qy,qz,qw,kind,tracked"


def write_log(tmp_path, rows):
    """The path of a CSV with these rows."""
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEAD, *rows, ""]))
    return path


def pose_at_second(time, body="cup"):
    """A row of a CSV: a pose of a body, whose x is the second."""
    return f"{time:.3f},{body},{time:.3f},0,0,0,0,0,1,pose,1"


def session_of_200_rows(tmp_path, rows_cut_short):
    """The session of 200 rows of which the last so many end after nine characters, and the path of its file."""
    rows = [pose_at_second(0.1 * k) for k in range(200)]
    whole, torn = rows[:-rows_cut_short], [row[:9] for row in rows[-rows_cut_short:]]
    session = import_session("csv", write_log(tmp_path, [*whole, *torn]))
    write_session(session, tmp_path / "s.mcap")
    return session, tmp_path / "s.mcap"


def test_ledger_of_an_import_comes_back_from_the_session_file(tmp_path):
    """Three of 200 rows are cut short and dropped: the session says so, and so does its file."""
    session, path = session_of_200_rows(tmp_path, rows_cut_short=3)
    sentence = "3 of 200 rows dropped: with too few or too many cells"
    assert ledger_text(session) == sentence
    assert ledger_of(read_session(path).facts).sentences() == ledger_of(session.facts).sentences()


@pytest.mark.parametrize(
    ("rows_cut_short", "counts"), [pytest.param(2, [], id="1 %"), pytest.param(3, [3], id="1.5 %")]
)
def test_only_losses_above_1_percent_are_findings(tmp_path, rows_cut_short, counts):
    """2 or 3 of 200 rows are dropped; the doctor, which examines session files, reports 3 and not 2."""
    _session, path = session_of_200_rows(tmp_path, rows_cut_short)
    findings = [finding for finding in examine(path) if finding.code == "import-loss"]
    assert [finding.count for finding in findings] == counts


def test_repeated_sample_is_merged_and_conflicting_sample_dropped(tmp_path):
    """50 samples are 0.1 s apart, x being the time; that of 0.3 s stands twice, and once more with x = 0.7 m."""
    rows = [pose_at_second(0.1 * k) for k in range(50)]
    conflicting = pose_at_second(time=0.3).replace("0.300,0,0", "0.700,0,0")
    session = import_session("csv", write_log(tmp_path, [*rows[:4], rows[3], conflicting, *rows[4:]]))
    assert np.allclose(session.tracks["cup"].positions[:, 0], 0.1 * np.arange(50))
    assert ledger_text(session).split("; ") == [
        "cup: 1 of 52 samples dropped: with the stamp of another sample",
        "cup: 1 of 52 samples merged: that repeat a sample",
    ]
