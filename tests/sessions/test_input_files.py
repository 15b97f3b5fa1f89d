"""Values of a TOML table: what is taken as written, and what is refused by its key."""

import pytest

from sessions.errors import ImportFileError, SceneError
from sessions.input_files import (
    MOST_NAMED,
    check_encoding,
    is_number,
    nearest,
    open_input,
    parse_toml,
    read_text,
    special_kind,
)

READ = {
    "count": lambda table: table.count("key", default=1, least=1, most=5),
    "number": lambda table: table.number("key", 1.0, above=0.0),
    "flag": lambda table: table.flag("key"),
    "text": lambda table: table.text("key", None),
    "text among": lambda table: table.text("key", default="auto", among=["a", "b"]),
    "texts": lambda table: table.texts("key", count=2),
    "text or texts": lambda table: table.text_or_texts("key"),
    "vector": lambda table: table.vector("key", (0.0, 0.0)),
    "named tables": lambda table: [*table.named_tables("key")],
    "tables": lambda table: len(table.tables("key")),
    "rest": lambda table: table.rest(),
}


@pytest.mark.parametrize(
    ("kind", "taken", "refused"),
    [
        ("count", {"1": 1, "5": 5}, ["0", "6", "2.0", "true"]),
        ("number", {"1e-9": 1e-9, "3": 3.0}, ["0.0", "-1", "inf", "nan", "true", "'1'"]),
        ("flag", {"true": True, "false": False}, ["0", "'yes'"]),
        ("text", {"'word'": "word"}, ["''", "1"]),
        ("text among", {"'a'": "a", "'auto'": "auto"}, ["'c'", "1"]),
        ("texts", {"['a', 'b']": ("a", "b")}, ["['a']", "['a', '']", "['a', 1]", "'ab'"]),
        ("text or texts", {"'ab'": ("ab",), "''": (), "['ab']": ("ab",), "[]": ()}, ["['a', '']", "[1]", "1"]),
        ("vector", {"[1, 2.5]": (1.0, 2.5)}, ["[1]", "[1, 2, 3]", "[1, 'b']", "[1, nan]", "1"]),
        ("named tables", {"{a = {}, b = {c = 1}}": ["a", "b"], "{}": []}, ["[{}]", "{a = 1}", "{a = {}, b = 2}"]),
        ("tables", {"[{}, {a = 1}]": 2, "[]": 0}, ["{}", "[{}, 1]"]),
        ("rest", {"[1, {a = 2.5}]": {"key": [1, {"a": 2.5}]}}, ["inf", "[1, nan]", "{a = [1, {b = inf}]}"]),
    ],
)
def test_value_is_taken_as_written_or_refused(kind, taken, refused):
    """A row is a ``kind`` of READ, TOML of values -> what is read, and TOML of values that are refused by their key."""
    for text, value in taken.items():
        assert READ[kind](parse_toml(f"key = {text}", "scene.toml", SceneError)) == value, text
    for text in refused:
        with pytest.raises(SceneError, match=r"scene.toml: key "):
            READ[kind](parse_toml(f"key = {text}", "scene.toml", SceneError))


def test_absent_tables_are_none_and_absent_values_defaults():
    """The TOML is empty; the default of ``texts`` is always an empty tuple."""
    table = parse_toml("", "scene.toml", SceneError)
    assert table.table("key") is None
    assert table.tables("key") is None
    assert table.named_tables("key") == {}
    assert table.text("key", default="auto") == "auto"
    assert table.texts("key") == ()
    assert table.vector("key", default=(1.0, 2.0)) == (1.0, 2.0)


def test_unknown_key_is_refused_with_the_nearest_known_key():
    """A table is queried for "group" and "mass", and then done with: any other key of it, as "mas", is unknown."""
    table = parse_toml("mas = 1\ngroup = 'a'", "scene.toml", SceneError)
    assert "group" in table
    assert "mass" not in table
    with pytest.raises(SceneError, match="unknown key 'mas'; did you mean 'mass'"):
        table.done()


def test_key_that_is_named_at_the_end_is_known():
    """Nobody queried the table for "mass"; ``done`` is given it as known, and says that no key was unknown."""
    assert parse_toml("mass = 1", "scene.toml", SceneError).done(known=["mass"])


def test_collected_faults_leave_defaults_and_reading_goes_on():
    """A list is given for faults: text for a number, and numbers for a flag and for text go there, and none is raised.

    What is read of such a key is its default.
    """
    faults = []
    table = parse_toml("a = 'x'\n[b]\nc = 2\nd = 1", "scene.toml", SceneError, faults)
    inner_table = table.table("b")
    assert table.number("a", default=3.0) == 3.0
    assert inner_table.flag("c", default=True) is True
    assert inner_table.text("d", default="auto") == "auto"
    assert faults == [
        "scene.toml: a is 'x'; give a finite number",
        "scene.toml: [b]: c is 2; give true or false",
        "scene.toml: [b]: d is 1; give text",
    ]


def test_nearest_name_is_searched_among_few():
    """An unknown name is compared with up to MOST_NAMED others; of more only the number is said."""
    names = [f"body {number}" for number in range(MOST_NAMED)]
    assert nearest("body 7x", names) == "; did you mean 'body 7'?"
    assert nearest("body 7x", [*names, "last"]) == f"; there are {MOST_NAMED + 1} others"


def test_names_of_which_none_is_near_are_listed():
    """The name "cup" is like neither "a" nor "b"."""
    assert nearest("cup", ["a", "b"]) == "; there are: a, b"
    assert nearest("cup", []) == "; there are none"


def test_numbers_are_finite_and_not_truth_values():
    """10**300 fits a double, 10**400 does not."""
    assert all(map(is_number, (0, -1.5, 10**300)))
    assert not any(map(is_number, (True, 10**400, float("nan"), "1", None)))


@pytest.mark.parametrize(
    ("length", "quoted"),
    [
        pytest.param(78, "'" + "x" * 78 + "'", id="80 with its quotes"),
        pytest.param(79, "'" + "x" * 76 + "...", id="81 with its quotes"),
    ],
)
def test_quoted_value_stays_on_a_line(length, quoted):
    """A key that must be true or false holds a text of ``length`` letters; an error quotes 80 characters at most.

    A longer text is cut after a quote and 76 letters, for three dots.
    """
    table = parse_toml(f"key = '{'x' * length}'", "scene.toml", SceneError)
    with pytest.raises(SceneError) as raised:
        table.flag("key")
    assert str(raised.value) == f"scene.toml: key is {quoted}; give true or false"


@pytest.mark.parametrize(
    "data", [pytest.param(b"t,x\n" * 60 + 60 * b"\0", id="zeros at the end"), pytest.param(b"a\0bc", id="one of four")]
)
def test_csv_may_have_zeros_in_a_quarter_of_its_bytes(tmp_path, data):
    """Some loggers write zeros: 60 behind 240 bytes of text, or one of four bytes, are accepted without an error."""
    check_encoding(tmp_path, data)


@pytest.mark.parametrize(
    "data",
    [
        pytest.param("t,x\n".encode("utf-16-le"), id="UTF-16"),
        pytest.param("t,x".encode("utf-16"), id="UTF-16 with its mark"),
        pytest.param(b"PK\x03\x04", id="an archive"),
        pytest.param(b"a\0b", id="a third zeros"),
    ],
)
def test_text_in_another_encoding_is_refused(tmp_path, data):
    """In UTF-16 half the bytes of Latin letters are zeros, over a quarter; an archive is known by its first bytes."""
    with pytest.raises(ImportFileError, match="this is no CSV"):
        check_encoding(tmp_path, data)


def test_line_ends_of_text_become_line_feeds(tmp_path):
    """A file has a byte order mark, then lines that end in CR LF, CR and LF."""
    (tmp_path / "scene.toml").write_bytes(b"\xef\xbb\xbfa\r\nb\rc\n")
    assert read_text(tmp_path / "scene.toml", "scene", SceneError) == "a\nb\nc\n"


def test_folder_is_no_regular_file(tmp_path):
    """A folder, a device or a pipe has a name for its kind, a regular file none ("")."""
    (tmp_path / "scene.toml").touch()
    assert special_kind(tmp_path) == "a folder"
    assert special_kind(tmp_path / "scene.toml") == ""


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"name = 'caf\xe9'", "scene .* is not UTF-8 text; save it as UTF-8"),
        ("name = 'cup'".encode("utf-16"), "scene .* is text in UTF-16"),
        (b" \n", "scene .* is empty"),
    ],
)
def test_text_that_cannot_be_read_is_named(tmp_path, data, message):
    """A scene in Latin-1, in UTF-16, and of a blank and a line feed."""
    (tmp_path / "scene.toml").write_bytes(data)
    with pytest.raises(SceneError, match=message):
        read_text(tmp_path / "scene.toml", "scene", SceneError)


def test_blank_text_is_read_where_it_may_be_empty(tmp_path):
    """A file of a space and a line feed is read as it is, where a caller says that it may be empty."""
    (tmp_path / "scene.toml").write_bytes(b" \n")
    assert read_text(tmp_path / "scene.toml", "scene", SceneError, may_be_empty=True) == " \n"


@pytest.mark.parametrize(
    ("error", "reason"), [(OSError(5, "Input/output error"), "Input/output error"), (OSError("torn"), "torn")]
)
def test_failed_read_says_what_the_system_says(tmp_path, error, reason):
    """An error of the system with a number and a text, or with a text alone, while the file is open."""
    (tmp_path / "scene.toml").write_bytes(b"name = 'cup'")
    with (
        pytest.raises(SceneError, match=rf"cannot be read \({reason}\); check"),
        open_input(tmp_path / "scene.toml", "scene", SceneError),
    ):
        raise error
