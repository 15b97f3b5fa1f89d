import pytest
from support.import_mutants import MUTANTS, tried

from sessions.importers import import_session
from sessions.importers.contacts_csv import read_contacts
from sessions.importers.csv_mapping import CsvMapping, PoseColumns
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
            happening("event", 2, "", "stage", "pouring"), happening("event", 1, "Beaker", "", '"a, b"'),
            happening("event", 3, "Beaker", "", "fell, hard"),  # a cell too many
            *(happening(kind, 1, "x") for kind in "aabcdefg"),
        ),
    )  # fmt: skip
    assert session.hands["student/left"].trigger.tolist() == [0.25, 0.0, 1.0, 0.0, 1.0]
    assert list(session.events) == [
        Event(1_000_000_000, "event", "a, b", "Beaker"),
        Event(2_000_000_000, "stage", "pouring"),
    ]
    said = session.facts["conversions"]
    assert "1 rows left out that have too few" in said
    assert "8 rows left out of unknown kind 'a', 'b', 'c', 'd', 'e', ..." in said


WIDE = CsvMapping("t", "ms", "gltf", bodies={"a": PoseColumns(tuple("xyz"), tuple("ijkw"))}, events=("stage", "mark"))
LONG = CsvMapping("t", "ms", "gltf", name="b", body=PoseColumns(tuple("xyz"), tuple("ijkw")), events=("held",))
POSE = "0,0,0,0,0,0,1"


@pytest.mark.parametrize(
    ("plan", "columns", "rows", "expected"),
    [
        (
            WIDE, "t,stage,mark", ("1,,", "2,pour,!", "3,pour,", "4,stir,!", "5,,", "6,stir,"),
            [(2, "stage", "pour"), (2, "mark", "!"), (4, "stage", "stir"), (4, "mark", "!"), (6, "stage", "stir")],
        ),
        (LONG, "t,b,held", ("1,l,cup", "1,r,", "2,l,cup", "2,r,rod"), [(1, "held", "cup"), (2, "held", "rod")]),
    ],
)  # fmt: skip
def test_every_new_text_in_a_column_of_events_is_one_event_of_its_body(tmp_path, plan, columns, rows, expected):
    path = written(tmp_path, f"{columns},x,y,z,i,j,k,w", *(f"{row},{POSE}" for row in rows))
    events = import_session("csv", path, mapping=plan).events
    assert [(event.time_ns // 10**6, event.name, event.message) for event in events] == expected


def test_rows_become_reports_in_order_of_time_to_the_nanosecond(tmp_path):
    path = written(tmp_path, "time,a,b,what", "1700000000.123456789,rod,beaker,end", "", " 0.5 , rod, beaker, Begin")
    assert read_contacts(path) == (
        LiveContact(500_000_000, "rod", "beaker", "enter"),
        LiveContact(1_700_000_000_123_456_789, "rod", "beaker", "exit"),
    )


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_of_contacts_end_in_reports_or_one_sentence(tmp_path, count):
    path = written(tmp_path, "time,a,b,what", *(f"{k / 8},rod,beaker,begin" for k in range(20)))
    tried(path, count, lambda _: read_contacts(path))
