"""A file of an engine's contacts in the dialects of spreadsheets, and what its header says."""

import pytest

from sessions.errors import ImportFileError
from sessions.importers.contacts_csv import read_contacts
from sessions.importers.ledger import Ledger

ROWS = ("0.5,cup,rod,begin", "1.25,cup,rod,end")


def contacts_and_ledger(tmp_path, text):
    """Reports of a CSV of contacts as (ns, body, body, phase), and the ledger's sentences about rows not kept."""
    path = tmp_path / "c.csv"
    path.write_text(text, encoding="utf-8")
    ledger = Ledger(path)
    contacts = [(row.time_ns, row.body_a, row.body_b, row.phase) for row in read_contacts(path, ledger)]
    return contacts, ledger.sentences()


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("\n".join(ROWS), id="no header"),
        pytest.param(
            "\ufeffTIMESTAMP,BodyA,BodyB,Event\r\n" + "\r\n".join(reversed(ROWS)), id="later row first, CR LF"
        ),
        pytest.param("sep=;\n" + "\n".join(ROWS).replace(",", ";"), id="Excel's sep="),
        pytest.param("time;a;b;what\n0,5;cup;rod;begin\n1,25;cup;rod;end\n", id="decimal commas"),
        pytest.param(
            "# of the engine\n\nwhat\tb\ta\tt [ms]\nenter\trod\tcup\t500\nexit\trod\tcup\t1250\n",
            id="other order, tabs, milliseconds",
        ),
        pytest.param(
            "time_us,a,b,what\n500000,cup,rod,OnCollisionEnter\n1250000,cup,rod,OnTriggerExit2D\n",
            id="Unity's words, microseconds",
        ),
        pytest.param(
            "when,one,two,what\n0.5,cup,rod,Begin_Overlap\n1.25,cup,rod,OnComponentEndOverlap\n", id="Unreal's words"
        ),
    ],
)
def test_same_contacts_are_read_from_every_dialect(tmp_path, text):
    """Each text says that cup and rod touch from 0.5 to 1.25 s; begin is stored as enter, end as exit."""
    contacts, sentences = contacts_and_ledger(tmp_path, text)
    assert contacts == [(500_000_000, "cup", "rod", "enter"), (1_250_000_000, "cup", "rod", "exit")]
    assert sentences == []


def test_repeated_reports_are_merged_and_booked(tmp_path):
    """The third row reports the first row's contact from the other body: same time, bodies exchanged."""
    contacts, sentences = contacts_and_ledger(tmp_path, "\n".join([*ROWS, "0.5,rod,cup,begin"]))
    assert contacts == [(500_000_000, "cup", "rod", "enter"), (1_250_000_000, "cup", "rod", "exit")]
    assert sentences == ["c.csv: 1 of 3 contacts merged: that repeat a report"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        # The four columns are time, a, b and what; a column "what" holds begin or end.
        ("time,a,b\n0.5,cup,rod\n", "line 1: the header names 'time', 'a', 'b', and 'what' not; write four"),
        ("time,a,b,what,impulse\n0.5,cup,rod,begin,1\n", "line 1: the header names .*'impulse'; write four"),
        ("time [days],a,b,what\n0.5,cup,rod,begin\n", "'days' is no unit of time; write seconds"),
        ("0.5,cup,cup,begin\n", "line 1: the bodies are 'cup' and 'cup'; name two bodies"),
        ("0.5,,rod,begin\n", "line 1: the bodies are '' and 'rod'; name two bodies"),
        ("0.5,cup,,begin\n", "line 1: the bodies are 'cup' and ''; name two bodies"),
        ("0.5,a,rod,touch\n", "line 1: 'touch' is neither begin nor end"),
        ("noon,a,rod,begin\n", "line 1: 'noon' is no time in seconds"),
        ("0.5,cup,rod\n", "line 1: 3 columns; write four: time, a, b, begin or end"),
    ],
)
def test_wrong_header_or_row_is_refused_with_its_cause(tmp_path, text, message):
    """A header of three or five names, an unknown unit, and rows that are no report of two bodies are refused.

    A row is a time, two bodies, and begin or end; a header is not needed.
    """
    with pytest.raises(ImportFileError, match=message):
        contacts_and_ledger(tmp_path, text)
