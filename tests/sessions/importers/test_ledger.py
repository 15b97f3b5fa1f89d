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
    """Random accounts (kind, body, rows kept, reason -> rows dropped, reason -> rows merged)."""
    ledger = Ledger("log.csv")
    for kind, body, kept, dropped, merged in accounts:
        read = kept + sum(dropped.values()) + sum(merged.values())
        ledger.book(kind, body, read=read, kept=kept, dropped=dropped, merged=merged)
    result = ledger_of({FACT: ledger.as_text()})
    assert list(result) == list(ledger)
    total = sum(kept + sum(dropped.values()) + sum(merged.values()) for _, _, kept, dropped, merged in accounts)
    assert sum(entry.read for entry in result) == total


@pytest.mark.parametrize(("read", "kept", "dropped"), [(3, 2, {}), (3, 3, {"torn": 1}), (2, 3, {"torn": -1})])
def test_an_account_that_does_not_add_up_is_never_booked(read, kept, dropped):
    """Rows read are those kept and dropped: 3 are not 2, nor 3 and 1, and no count is negative.

    Text with such an account is read as no ledger.
    """
    with pytest.raises(AssertionError):
        Ledger("log").book("rows", read=read, kept=kept, dropped=dropped)
    assert ledger_of({FACT: json.dumps([["rows", "", read, kept, dropped, {}]])}) is None


@pytest.mark.parametrize(
    "text", ["", "[", "{}x", "3", '[["rows"]]', '[["rows","",1,true,{},{}]]', '[["x","",1,1,{},{}]]', "[" * 9999]
)
def test_malformed_import_ledger_is_read_as_absent(text):
    """No JSON, JSON of another form, a truth value for a count, an unknown kind, and JSON nested too deeply."""
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


@pytest.mark.parametrize(("short", "warns"), [(2, False), (3, True)])
def test_only_losses_above_1_percent_are_findings(tmp_path, short, warns):
    """2 or 3 of 200 rows are cut short; the ledger has both, the doctor reports 1.5 % and not 1 %."""
    rows = [pose_at_second(0.1 * k) for k in range(200)]
    session = import_session("csv", write_log(tmp_path, [*rows[:-short], *(text[:9] for text in rows[-short:])]))
    assert ledger_text(session) == f"{short} of 200 rows dropped: with too few or too many cells"
    write_session(session, tmp_path / "s.mcap")
    assert ledger_of(read_session(tmp_path / "s.mcap").facts).sentences() == ledger_of(session.facts).sentences()
    result = [finding for finding in examine(tmp_path / "s.mcap") if finding.code == "import-loss"]
    assert [finding.count for finding in result] == [short] * warns


def test_repeated_sample_is_merged_and_conflicting_sample_dropped(tmp_path):
    """50 samples 0.1 s apart; that of 0.3 s stands twice, and once more with another position."""
    rows = [pose_at_second(0.1 * k) for k in range(50)]
    other = pose_at_second(time=0.3).replace("0.300,0,0", "0.700,0,0")
    session = import_session("csv", write_log(tmp_path, [*rows[:4], rows[3], other, *rows[4:]]))
    assert np.allclose(session.tracks["cup"].positions[:, 0], 0.1 * np.arange(50))
    assert ledger_text(session).split("; ") == [
        "cup: 1 of 52 samples dropped: with the stamp of another sample",
        "cup: 1 of 52 samples merged: that repeat a sample",
    ]
