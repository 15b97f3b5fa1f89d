import pytest

from sessions.errors import ImportFileError
from sessions.importers.contacts_csv import read_contacts
from sessions.model.live_contact import LiveContact


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


def test_without_a_header_the_first_row_counts_and_a_mark_of_utf8_is_skipped(tmp_path):
    path = tmp_path / "c.csv"
    path.write_bytes(b"\xef\xbb\xbf-1,x,y,enter\r\n")
    assert read_contacts(path) == (LiveContact(-1_000_000_000, "x", "y", "enter"),)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0,a,b\n", r"line 1: 3 columns; write four"),
        ("0,a,b,begin\nx,a,b,end\n", r"line 2: 'x' is no time"),
        ("inf,a,b,begin\n", "is no time in seconds"),
        ("1e30,a,b,begin\n", "is no time in seconds"),
        ("0,a,b,maybe\n", "'maybe' is neither begin nor end"),
        ("time,a,b,what\n", "holds no contact"),
    ],
)
def test_a_bad_file_is_named_with_its_line(tmp_path, text, words):
    with pytest.raises(ImportFileError, match=words):
        read_contacts(file(tmp_path, text))
    (tmp_path / "c.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ImportFileError, match="no UTF-8"):
        read_contacts(tmp_path / "c.csv")
