import pytest

from sessions.errors import SceneError
from sessions.scene_files.toml_table import Table, is_number, nearest, parse_toml


def test_what_nobody_asked_for_is_unknown_and_the_nearest_asked_for_is_named():
    table = Table({"colour": "red", "sise": 1}, "f.toml", "[x]", SceneError)
    assert table.text("colour") == "red"
    table.number("size", 0.0)
    with pytest.raises(SceneError, match=r"f.toml: \[x\]: unknown key 'sise'; did you mean 'size'\?"):
        table.done()


def test_true_is_no_number_and_infinity_neither():
    assert is_number(1)
    assert is_number(1.5)
    assert not any(is_number(value) for value in (True, float("inf"), float("nan"), "1", None, 10**400))


def test_without_a_near_name_all_are_listed():
    assert nearest("zzz", ["b", "a"]) == "; there are: a, b"
    assert nearest("zzz", []) == "; there are none"


def test_nested_tables_carry_their_place():
    whole = parse_toml("[a]\nb = { c = 1 }\n[[d]]\ne = 1\n", "f.toml", SceneError)
    inner = whole.table("a").table("b")
    with pytest.raises(SceneError, match=r"f.toml: \[a\] b: c is 1; give text"):
        inner.text("c")
    (row,) = whole.tables("d")
    with pytest.raises(SceneError, match=r"\[\[d\]\] 1: e is 1; give true or false"):
        row.flag("e")


def test_a_hostile_nesting_is_an_error_and_no_crash():
    with pytest.raises(SceneError, match=r"nested too deeply|not TOML"):
        parse_toml("a = " + "[" * 100_000, "f.toml", SceneError)
