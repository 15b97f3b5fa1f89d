import pytest

from replay.effects import EFFECTS, load_effect
from replay.errors import EffectError


@pytest.mark.parametrize("kind", EFFECTS)
def test_every_row_leads_to_a_spec_of_its_name_that_needs_and_uses_rows(kind):
    spec = load_effect(kind)
    assert spec.kind == kind and callable(spec.compute) and spec.about.endswith(".")
    assert {*spec.needs, *spec.needs_if, *spec.uses} <= set(EFFECTS)


@pytest.mark.parametrize("kind", EFFECTS)
def test_every_field_says_what_it_is_and_every_default_of_a_quantity_has_a_source(kind):
    for field in load_effect(kind).fields.values():
        assert field.about
        if field.kind == "number" and isinstance(field.default, float):
            assert field.source, f"{kind}: {field.about}"


def test_an_unknown_kind_is_refused_with_those_there_are():
    with pytest.raises(EffectError, match=r"no effect 'pur'; there are: .*contact"):
        load_effect("pur")


def test_a_row_that_cannot_be_loaded_or_calls_itself_otherwise_says_so(monkeypatch):
    monkeypatch.setitem(EFFECTS, "x", "replay.effects.nowhere:SPEC")
    with pytest.raises(EffectError, match=r"effect 'x' \(replay.effects.nowhere:SPEC\) cannot be loaded: .*repair"):
        load_effect("x")
    monkeypatch.setitem(EFFECTS, "x", EFFECTS["contact"])
    with pytest.raises(EffectError, match="calls itself 'contact' and its row 'x'"):
        load_effect("x")
