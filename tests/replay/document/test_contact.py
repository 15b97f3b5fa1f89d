"""The document names its contacts, faults and events; a run in memory and its folder hold the same records."""

import json
from dataclasses import replace
from typing import get_args

import msgspec
import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay import run
from replay.document.columns import file_columns
from replay.document.contact import ContactRecord, EventRecord
from replay.document.run_document import StoredTable
from replay.document.tables import ARROW_TYPES
from replay.errors import RunFolderError
from replay.show.results.run_folder import read_run_folder
from sessions.model.session import Event

RECORDS = {"episodes": ContactRecord, "events": EventRecord}
"""Table of a run folder -> what a row of it is read as; episodes are contacts."""


@pytest.fixture(scope="module")
def run_and_folder(tmp_path_factory):
    """A run in memory and its folder: two cubes touch in frame 4 and in frames 8 to 10, of 10 ms, with a note.

    The detector ``slow`` samples at 5 Hz, every twentieth frame, and misses both contacts.
    """
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)
    poured = Event(int(session.stamps()[3]), "note", "poured", "a")
    session = replace(session, events=(poured,))
    folder = tmp_path_factory.mktemp("runs") / "run"
    return run(session, detectors="slow=discrete[rate_hz=5]", out=folder, picture=False), folder


def test_the_document_counts_the_rows_of_its_tables(run_and_folder):
    """Expected are the counts of the run in memory, and the one note; both contacts are missed, and none is false."""
    result, folder = run_and_folder
    rows = {
        "episodes": sum(len(contacts) for contacts in result.contacts.values()),
        "misses": sum(len(misses) for misses in result.misses.values()),
        "false": sum(len(false_contacts) for false_contacts in result.false.values()),
        "events": 1,
    }
    assert rows["misses"] == 2
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["tables"] == {name: {"file": f"{name}.parquet", "rows": count} for name, count in rows.items()}


def test_run_in_memory_and_its_folder_have_the_same_records(run_and_folder):
    """Contacts and events are equal; of faults their numbers (a test below compares the rest)."""
    result, folder = run_and_folder
    read = read_run_folder(folder)
    assert {label: tuple(contacts) for label, contacts in read.contacts.items()} == {
        label: tuple(contacts) for label, contacts in result.contacts.items()
    }
    assert read.events == result.events
    assert [event.message for event in read.events] == ["poured"]
    assert {label: [fault.number for fault in faults] for label, faults in read.faults.items()} == {
        label: [fault.number for fault in faults] for label, faults in result.faults.items()
    }


@pytest.mark.parametrize("name", ["episodes", "misses", "events"])
def test_a_table_of_other_length_than_counted_is_refused(run_and_folder, name):
    """The document in a run folder is made to count 99 rows of a table, which has a few (one digit)."""
    _, folder = run_and_folder
    read = read_run_folder(folder)
    read.document.tables[name] = StoredTable(file=f"{name}.parquet", rows=99)
    with pytest.raises(RunFolderError, match=f"{name}.parquet holds . rows, and summary.json counts 99"):
        read.rows(name)


def plain_types(annotation):
    """Types of columns in an annotation: int of ``int | None``, float of ``tuple[float, float]``."""
    if isinstance(annotation, type) and annotation in ARROW_TYPES:
        return [annotation]
    return [type_ for inner in get_args(annotation) for type_ in plain_types(inner)]


@pytest.mark.parametrize("name", RECORDS)
def test_fields_of_a_record_are_declared_columns_of_their_type(name):
    """Columns of the file are declared apart from the record that is read of a row; only some may be missing."""
    columns = {column.name: column for column in file_columns(name)}
    for field in msgspec.structs.fields(RECORDS[name]):
        column = columns[field.encode_name]
        assert set(plain_types(field.type)) == {column.dtype}, field.name
        assert column.required == field.required, field.name


def test_faults_read_from_a_run_folder_equal_the_run(run_and_folder):
    """All fields but what a folder does not store: first touch, nearest faces, how many frames agree on the cause."""
    result, folder = run_and_folder
    faults_read = read_run_folder(folder).faults
    assert any(result.faults.values())
    for label, faults in result.faults.items():
        for fault, read in zip(faults, faults_read[label], strict=True):
            stored_evidence = replace(fault.evidence, touch=None, nearest=None)
            assert read == replace(fault, evidence=stored_evidence, agreeing=(0, 0))
