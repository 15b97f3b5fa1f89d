import pytest

from replay.effects import EFFECTS, effect_kinds, load_effect
from replay.effects.declaring import Declaration
from replay.effects.protocol import EffectOutput, EffectSpec, Need
from replay.errors import EffectError


@pytest.mark.parametrize("kind", EFFECTS)
def test_every_row_leads_to_a_spec_of_its_name_that_needs_and_uses_rows(kind):
    spec = load_effect(kind)
    assert spec.kind == kind and callable(spec.compute) and spec.about.endswith(".")
    assert {need.kind if isinstance(need, Need) else need for need in spec.needs} <= set(EFFECTS)
    assert set(spec.uses) <= set(EFFECTS)


@pytest.mark.parametrize("kind", EFFECTS)
def test_every_field_says_what_it_is_and_every_default_of_a_quantity_has_a_source(kind):
    for field in load_effect(kind).fields.values():
        assert field.about
        if field.kind == "number" and isinstance(field.default, float):
            assert field.source, f"{kind}: {field.about}"


def test_an_unknown_kind_is_refused_with_those_there_are():
    with pytest.raises(EffectError, match=r"no effect 'pur'; there are: .*contact"):
        load_effect("pur")


def test_a_row_that_cannot_be_loaded_or_calls_itself_otherwise_says_so():
    with pytest.raises(EffectError, match=r"effect 'x' \(replay.effects.nowhere:SPEC\) cannot be loaded: .*repair"):
        load_effect("x", {"x": "replay.effects.nowhere:SPEC"})
    with pytest.raises(EffectError, match="calls itself 'contact' and its row 'x'"):
        load_effect("x", {"x": EFFECTS["contact"]})


def test_an_effect_of_an_installed_package_that_cannot_be_loaded_names_it(monkeypatch, tmp_path):
    (tmp_path / "breaks_on_import.py").write_text("raise ZeroDivisionError('boom')")
    monkeypatch.syspath_prepend(tmp_path)
    (info := tmp_path / "boiling-1.0.dist-info").mkdir()
    (info / "METADATA").write_text("Name: boiling\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[vrlab_replay.effects]\nboil = breaks_on_import:SPEC\n")
    with pytest.raises(
        EffectError, match=r"^effect 'boil' \(breaks_on_import:SPEC\) cannot be loaded: boom; repair or"
    ):
        load_effect("boil")
    assert effect_kinds()[-1] == "boil" and load_effect("pour").kind == "pour"


def test_the_table_comes_before_what_is_installed():
    assert effect_kinds()[: len(EFFECTS)] == tuple(EFFECTS)


def test_needs_depend_on_the_declarations_that_have_the_field():
    spec = EffectSpec("heat", "x", lambda inputs: EffectOutput(), needs=("a", Need("pour", "of", ("dilution",))))
    flame, dilution = (Declaration("heat", "f", "p", {"of": word}) for word in ("flame", "dilution"))
    assert spec.needed(()) == spec.needed((flame,)) == ("a",)
    assert spec.needed((flame, dilution)) == ("a", "pour")
