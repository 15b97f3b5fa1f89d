from dataclasses import replace

import numpy as np
import pytest

from replay.effects import EFFECTS, declaring, effect_kinds, load_effect
from replay.effects.declaring import Declaration, declare
from replay.effects.effect_plan import NOT_BUILT
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Liquid, Series
from replay.effects.protocol import EffectSpec, Need
from replay.errors import EffectError, PlanError
from sessions.model.scene import Scene, SceneBody, SceneEffect


@pytest.mark.parametrize("kind", EFFECTS)
def test_every_row_leads_to_a_spec_of_its_name_that_needs_and_uses_rows(kind):
    spec = load_effect(kind)
    assert spec.kind == kind and callable(spec.compute) and spec.about.endswith(".")
    assert {need.kind if isinstance(need, Need) else need for need in spec.needs} <= {*EFFECTS, *NOT_BUILT}
    assert set(spec.uses) <= {*EFFECTS, *NOT_BUILT}


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
    with pytest.raises(EffectError, match=r"effect 'x' cannot be loaded: .*repair"):
        load_effect("x", {"x": "replay.effects.nowhere:SPEC"})
    with pytest.raises(EffectError, match="calls itself 'contact' and its row 'x'"):
        load_effect("x", {"x": EFFECTS["contact"]})


def test_the_table_comes_before_what_is_installed():
    assert effect_kinds()[: len(EFFECTS)] == tuple(EFFECTS)


def test_needs_depend_on_the_declarations_that_have_the_field():
    spec = EffectSpec("heat", "x", lambda inputs: EffectOutput(), needs=("a", Need("pour", "of", ("dilution",))))
    flame, dilution = (Declaration("heat", "f", "p", {"of": word}) for word in ("flame", "dilution"))
    assert spec.needed(()) == spec.needed((flame,)) == ("a",)
    assert spec.needed((flame, dilution)) == ("a", "pour")


TIMES = np.arange(3.0)
LIQUID = Liquid(TIMES, np.ones(3), 0.1, 0.2, np.zeros((3, 4), dtype=np.uint8))
WHOLE = EffectOutput(
    (EffectEvent(1.0, "spill", ("cup",), 2.0, {"volume_ml": np.float64(3.0)}, point=(0.0, 1.0, 2.0)),),
    {"cup/volume": Series(TIMES, TIMES * 2, "mL")},
    {"cup": (LaneSpan(0.0, 1.0, "pours"),)},
    np.array([True, False, True]),
    {"cup": LIQUID},
)


def test_equal_outputs_have_equal_digests_whatever_they_tell_other_effects():
    assert WHOLE.digest == replace(WHOLE, data=object()).digest


@pytest.mark.parametrize(
    "changed",
    [
        {"events": ()}, {"events": (replace(WHOLE.events[0], values={"volume_ml": 3.0000001}),)},
        {"series": {"cup/volume": Series(TIMES, np.nextafter(TIMES * 2, 9), "mL")}},
        {"series": {"cup/volume": Series(TIMES, TIMES * 2, "L")}}, {"lanes": {}}, {"ran": None},
        {"liquids": {"cup": replace(LIQUID, floor=0.11)}},
    ],
)  # fmt: skip
def test_any_difference_shows_in_the_digest(changed):
    assert replace(WHOLE, **changed).digest != WHOLE.digest


def test_an_event_without_a_message_speaks_of_its_bodies():
    assert EffectEvent(0.0, "contact", ("cup", "top")).text == "contact cup - top"
    assert EffectEvent(0.0, "end-point", message="pink").text == "pink"


def test_events_are_found_by_name():
    assert WHOLE.named("spill") == WHOLE.events and WHOLE.named("pour") == ()


def test_arrays_of_different_length_are_refused():
    with pytest.raises(ValueError, match="a series has times"):
        Series(TIMES, np.ones(2))
    with pytest.raises(ValueError, match="a liquid has 3 times"):
        Liquid(TIMES, np.ones(2), 0.0, 0.1, np.zeros((3, 4), dtype=np.uint8))


SCENE = Scene(bodies=(SceneBody("cup", tags=("glass",)), SceneBody("jar", tags=("glass",)), SceneBody("top")))
FIELDS = {
    "from": declaring.bodies("who pours"),
    "into": declaring.body("who receives", required=False),
    "between": declaring.pairs("who meets", required=False),
    "speed": declaring.number("how fast", "m/s", default=2.0, above=0.0, most=9.0),
    "of": declaring.text("what", default="", among=("flame", "dilution")),
    "tip": declaring.vector("where", default=(0.0, 0.0, 0.0)),
    "on": declaring.flag("whether", default=True),
    "colours": declaring.mapping("which", default={}),
}


def made(**settings):
    return declare(SceneEffect("pour", {"from": "cup", **settings}), 2, FIELDS, SCENE, "lab.toml")


def test_absent_fields_have_their_defaults():
    declared = made()
    assert declared.bodies("from") == ("cup",) and declared.body("into") == "" and declared.pairs() == ()
    assert (declared.number("speed"), declared.text("of"), declared.vector("tip")) == (2.0, "", (0.0, 0.0, 0.0))
    assert declared.values["on"] is True and declared.mapping("colours") == {}


def test_given_fields_are_checked_and_selectors_become_names():
    declared = made(
        **{"from": ["tag:glass", "cup"], "into": "jar", "between": ["tag:glass", "top"], "speed": 3, "of": "flame"},
        tip=[1, 2.5, 3], on=False, colours={"Na": "yellow"},
    )  # fmt: skip
    assert declared.bodies("from") == ("cup", "jar") and declared.body("into") == "jar"
    assert declared.pairs() == (("cup", "top"), ("jar", "top")) and declared.number("speed") == 3.0
    assert declared.vector("tip") == (1.0, 2.5, 3.0) and declared.mapping("colours") == {"Na": "yellow"}


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"from": "cap"}, "from: no body is 'cap'; did you mean 'cup'"),
        ({"from": "tag:glas"}, "no body is 'tag:glas'; did you mean 'tag:glass'"), ({"from": []}, "from is empty"),
        ({"from": [3]}, "from names 3"), ({"into": "tag:glass"}, "which stands for cup, jar; give one body"),
        ({"between": ["cup"]}, r"between is \['cup'\]; give two"),
        ({"between": ["cup", "cup"]}, "pairs 'cup' with itself"),
        ({"speed": "fast"}, "speed is 'fast'; give a finite number in m/s"),
        ({"speed": float("nan")}, "give a finite number"), ({"speed": True}, "give a finite number"),
        ({"speed": 0.0}, "give above 0.0 m/s"), ({"speed": 9.5}, "give at most 9.0 m/s"),
        ({"of": "flme"}, "did you mean 'flame'"), ({"of": ""}, "of is ''; give text"),
        ({"tip": [1, 2]}, "give three finite numbers"), ({"on": 1}, "give true or false"),
        ({"colours": 3}, "give a table"), ({"spede": 3}, "unknown key 'spede'; did you mean 'speed'"),
    ],
)  # fmt: skip
def test_a_wrong_field_is_named_with_file_table_and_key(settings, said):
    with pytest.raises(PlanError, match=r"lab.toml: \[\[effect\]\] 2 \('pour'\): .*" + said):
        made(**settings)


def test_a_required_field_that_is_missing_says_what_it_is():
    with pytest.raises(PlanError, match="from is missing: who pours"):
        declare(SceneEffect("pour", {}), 1, FIELDS, SCENE, "lab.toml")


def test_a_declaration_refuses_in_the_same_words():
    assert str(made().fail("no")) == "lab.toml: [[effect]] 2 ('pour'): no"
