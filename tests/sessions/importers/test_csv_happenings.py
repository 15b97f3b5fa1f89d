import pytest
from support.import_mutants import MUTANTS, tried

from sessions.importers.contacts_csv import read_contacts
from sessions.importers.csv_file import CsvLog
from sessions.importers.csv_mapping import UNITY, CsvMapping, PoseColumns
from sessions.importers.csv_table import CsvTable
from sessions.model.event import Event, LiveContact

HEADER = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"
WIDE = CsvMapping("t", "ms", "openxr", bodies={"a": PoseColumns(("x", "x", "x"))}, events=("stage", "mark"))


def table(tmp_path, *lines):
    path = tmp_path / "t.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return CsvTable(path, ",", ".")


def happening(kind, time, body, other="", value=""):
    return f"{kind},{time},{body}{',' * 9}{other},{value}"


def test_a_trigger_stays_between_released_and_pressed(tmp_path):
    values = ("0.25", "", "inf", "-1", "7")
    cells = table(tmp_path, HEADER, *(happening("trigger", k, "LeftHand", "", v) for k, v in enumerate(values)))
    assert CsvLog(cells, UNITY).hands()["student/left"].trigger.tolist() == [0.25, 0.0, 1.0, 0.0, 1.0]


def test_rows_of_kind_event_are_events_by_time(tmp_path):
    cells = table(
        tmp_path,
        HEADER,
        happening("event", 2, "", "stage", "pouring"),
        happening("event", 1, "Beaker", "", "fell, hard"),
    )
    assert len(cells) == 1
    cells = table(
        tmp_path, HEADER, happening("event", 2, "", "stage", "pouring"), happening("event", 1, "Beaker", "", '"a, b"')
    )
    assert CsvLog(cells, UNITY).events() == [
        Event(1_000_000_000, "event", "a, b", "Beaker"),
        Event(2_000_000_000, "stage", "pouring"),
    ]


def test_every_new_text_in_a_column_of_events_is_one_event(tmp_path):
    cells = table(tmp_path, "t,x,stage,mark", "1,0,,", "2,0,pour,!", "3,0,pour,", "4,0,stir,!", "5,0,,", "6,0,stir,")
    assert [(one.time_ns, one.name, one.message) for one in CsvLog(cells, WIDE).events()] == [
        (2_000_000, "stage", "pour"),
        (2_000_000, "mark", "!"),
        (4_000_000, "stage", "stir"),
        (4_000_000, "mark", "!"),
        (6_000_000, "stage", "stir"),
    ]


def test_in_a_long_table_each_body_has_its_own_row_before(tmp_path):
    plan = CsvMapping("t", "ms", "openxr", name="b", body=PoseColumns(("x", "x", "x")), events=("held",))
    cells = table(tmp_path, "t,b,x,held", "1,l,0,cup", "1,r,0,", "2,l,0,cup", "2,r,0,rod")
    assert [(one.body, one.message) for one in CsvLog(cells, plan).events()] == [("l", "cup"), ("r", "rod")]


@pytest.mark.parametrize(
    ("kinds", "said"),
    [
        ("", []),
        ("a", ["1 rows left out of unknown kind 'a'"]),
        ("aab", ["3 rows left out of unknown kind 'a', 'b'"]),
        ("abcdefg", ["7 rows left out of unknown kind 'a', 'b', 'c', 'd', 'e', ..."]),
    ],
)
def test_rows_of_unknown_kinds_are_counted_and_named(tmp_path, kinds, said):
    cells = table(tmp_path, HEADER, happening("enter", 0, "x", "y"), *(happening(kind, 1, "x") for kind in kinds))
    assert CsvLog(cells, UNITY).unknown_kinds() == said


def file(tmp_path, text):
    path = tmp_path / "c.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_rows_become_reports_in_order_of_time_to_the_nanosecond(tmp_path):
    path = file(tmp_path, "time,a,b,what\n1700000000.123456789,rod,beaker,end\n\n 0.5 , rod, beaker, Begin\n")
    assert read_contacts(path) == (
        LiveContact(500_000_000, "rod", "beaker", "enter"),
        LiveContact(1_700_000_000_123_456_789, "rod", "beaker", "exit"),
    )


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_of_contacts_end_in_reports_or_one_sentence(tmp_path, count):
    path = file(tmp_path, "time,a,b,what\n" + "".join(f"{k / 8},rod,beaker,begin\n" for k in range(20)))
    tried(path, count, lambda _: read_contacts(path))
