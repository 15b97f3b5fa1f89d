import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import UNITY, read_mapping

LONG = """
convention = "unity"
[time]
column = "time"
unit = "s"
[body]
name = "body"
position = ["px", "py", "pz"]
quaternion_xyzw = ["qx", "qy", "qz", "qw"]
valid = "tracked"
[rows]
column = "kind"
enter = "enter"
exit = "exit"
other = "other"
trigger = "trigger"
value = "value"
event = "event"
"""


def read(tmp_path, text):
    path = tmp_path / "map.toml"
    path.write_text(text)
    return read_mapping(path)


def test_the_built_in_mapping_can_be_written_as_a_file(tmp_path):
    assert read(tmp_path, LONG) == UNITY


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('unit = "s"', 'unit = "sec"', r"map.toml: \[time\]: unit is 'sec'"),
        ('unit = "s"', "", r"\[time\]: unit is missing"),
        ('convention = "unity"', 'convention = "unitty"', "did you mean 'unity'"),
        ('convention = "unity"', 'delimiter = "ab"', "give one character"),
        ('"px", "py", "pz"', '"px", "py"', "position has 2 entries; give 3"),
        ('valid = "tracked"', 'vallid = "tracked"', r"\[body\]: unknown key 'vallid'; did you mean 'valid'\?"),
        ('valid = "tracked"', 'euler = ["a", "b", "c"]', "give quaternion_xyzw"),
        ("[body]", "[bodies.x]", "needs|unknown key 'name'"),
        ('other = "other"', "", "enter and exit need other"),
        ('value = "value"', "", "trigger needs value"),
        ('enter = "enter"\nexit = "exit"\nother = "other"', "", "event needs other"),
        ('convention = "unity"', 'event_columns = "stage"', "event_columns is 'stage'; give a list of texts"),
        ("[time]", "[time", "not TOML"),
    ],
)
def test_a_mistake_is_named_with_file_table_and_key(tmp_path, old, new, message):
    with pytest.raises(ImportFileError, match=message):
        read(tmp_path, LONG.replace(old, new, 1))


@given(
    st.lists(st.sampled_from([*LONG.splitlines(), "[bodies.x]", "position = 3", "unit = 0x" + "f" * 5000]), max_size=20)
)
def test_no_mapping_ends_in_anything_but_a_mapping_or_one_named_error(tmp_path_factory, lines):
    try:
        read(tmp_path_factory.mktemp("fuzz"), "\n".join(lines))
    except ImportFileError as error:
        assert str(error).startswith("map.toml: ")


def test_a_missing_mapping_is_one_sentence(tmp_path):
    with pytest.raises(ImportFileError, match=r"mapping .* does not exist"):
        read_mapping(tmp_path / "no.toml")
