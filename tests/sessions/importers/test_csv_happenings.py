import pytest
from support.import_mutants import MUTANTS, tried

from sessions.importers import import_session
from sessions.importers.contacts_csv import read_contacts
from sessions.model.event import Event, LiveContact

HEADER = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"


def written(tmp_path, *lines):
    path = tmp_path / "t.csv"
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


def happening(kind, time, body, other="", value=""):
    return f"{kind},{time},{body}{',' * 9}{other},{value}"


def test_rows_that_are_no_poses_are_triggers_events_and_kinds_that_nobody_knows(tmp_path):
    session = import_session(
        "csv",
        written(
            tmp_path, HEADER, "pose,0,cup,0,0,0,0,0,0,1,1,,",
            *(happening("trigger", k, "LeftHand", "", v) for k, v in enumerate(("0.25", "", "inf", "-1", "7"))),
            happening("event", 2, "", "act", "pouring"), happening("event", 1, "Beaker", "", '"a, b"'),
            happening("event", 3, "Beaker", "", "fell, hard"),  # a cell too many
            *(happening(kind, 1, "x") for kind in "aabcdefg"),
        ),
    )  # fmt: skip
    assert session.hands["student/left"].trigger.tolist() == [0.25, 0.0, 1.0, 0.0, 1.0]
    assert list(session.events) == [
        Event(1_000_000_000, "event", "a, b", "Beaker"),
        Event(2_000_000_000, "act", "pouring"),
    ]
    said = session.facts["conversions"]
    assert "1 rows left out that have too few" in said
    assert "8 rows left out of 7 unknown kinds such as 'a', 'b', 'c', 'd', 'e'" in said


def test_rows_become_reports_in_order_of_time_to_the_nanosecond(tmp_path):
    path = written(tmp_path, "time,a,b,what", "1700000000.123456789,rod,beaker,end", "", " 0.5 , rod, beaker, Begin")
    assert read_contacts(path) == (
        LiveContact(500_000_000, "rod", "beaker", "enter"),
        LiveContact(1_700_000_000_123_456_789, "rod", "beaker", "exit"),
    )


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_of_contacts_end_in_reports_or_one_sentence(tmp_path, count):
    path = written(tmp_path, "time,a,b,what", *(f"{k / 8},rod,beaker,begin" for k in range(20)))
    tried(path, count, lambda: read_contacts(path))
