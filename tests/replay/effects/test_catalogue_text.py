"""The output of `replay scene effects` is whole, fits a terminal, and can be copied."""

import tomllib

import pytest
from support.liquid_worlds import TABLES, scene_with_changes

from replay.effects import CATALOGUE
from replay.effects.catalogue_text import catalogue_data, catalogue_lines, example_of, fields_of, toml_of
from replay.effects.declaring import READERS
from replay.effects.effect_plan import plan
from replay.errors import EffectError
from sessions.model.scene import Scene, SceneBody

SCENE = Scene(bodies=(SceneBody("flask", tags=("glass",)), SceneBody("left", tags=("hand",))))


def test_every_key_is_printed_with_its_meaning_in_eighty_columns():
    """``replay scene effects KIND`` prints these lines, the meaning of a key perhaps over several of them."""
    for kind in CATALOGUE:
        lines = list(catalogue_lines((kind,)))
        unwrapped = " ".join(" ".join(lines).split())
        for key, row in CATALOGUE[kind]["fields"].items():
            meaning = next(iter(row.values()))  # a row starts with its kind of value = the meaning
            assert f"{key} = " in unwrapped and meaning in unwrapped, (kind, key)
        assert max(map(len, lines)) <= 80 and lines[0].startswith(f"{kind}: "), kind


def test_every_example_is_toml_that_the_effect_accepts():
    """For each key of an effect a value to copy is printed; the reader of a scene's values of its kind accepts it.

    A reader raises ``ValueError`` on a wrong value, as does TOML on a text that it cannot read.
    """
    refused = {}
    for kind in CATALOGUE:
        for key in CATALOGUE[kind]["fields"]:
            field = fields_of(kind)[key]
            try:
                value = tomllib.loads(f"{key} = {toml_of(example_of(field))}")[key]
                READERS[field.kind](value, field, SCENE)
            except ValueError as error:
                refused[kind, key] = str(error)
    assert refused == {}


INDICATOR = ("indicator", "from_ph", "to_ph", "acid_colour", "base_colour")
ION = ("species", "colour", "full_mol_l")
FLAME = ("base", "within", "height", "turns_c", "from_colour", "to_colour", "power_w")
TOGETHER = {
    **{table["kind"]: (name, (), ()) for name, table in TABLES.items()},
    "reaction": ("zinc", (), ()),
    "colour": ("pink", ION, ()),
    "colour of an ion": ("pink", INDICATOR, ("pink.indicator",)),
    "heat": ("warm", ("of", *FLAME), ()),
    "heat of a flame": ("flame", ("heat_capacity_j_per_ml_k",), ()),
}
"""Kind of effect -> a table of it, keys that are an alternative to the others, and what the scene then leaves out."""


def test_all_examples_of_an_effect_make_a_scene():
    """A scene with an effect of every kind is changed: one table gets the printed example of each of its keys.

    ``row``: the kind of its effect. Left out are keys for bodies, and ``alternatives`` to others, as an ion is to an
    indicator; ``absent`` ones are taken out of the scene. It is planned without a fault, which would raise.
    """
    for row in TOGETHER:
        name, alternatives, absent = TOGETHER[row]
        fields = fields_of(TABLES[name]["kind"]).items()
        chosen = {key: field for key, field in fields if field.kind not in ("body", "bodies", "pairs")}
        examples = {key: tomllib.loads(f"x = {toml_of(example_of(field))}")["x"] for key, field in chosen.items()}
        changes = {f"{name}.{key}": value for key, value in examples.items() if key not in alternatives}
        if changes.get(f"{name}.species") == "MnO4-":
            changes["flask.properties.liquid.solutes.KMnO4"] = 0.01  # an ion that nobody brings has no colour
        assert plan(scene_with_changes(changes, absent)).effects, row


def test_key_without_a_default_is_required_unless_optional():
    """A threshold has to be declared; ``surface_c`` is optional; an amount that counts as a pour has a default."""
    keys = {
        kind: {key for key, row in rows.items() if row["required"]}
        for kind, rows in catalogue_data(("burn-exposure", "pour")).items()
    }
    assert keys == {"burn-exposure": {"between", "threshold_c", "seconds"}, "pour": {"from"}}


def test_no_kind_prints_all_and_an_unknown_is_refused():
    """Asked for no kind of effect, the text has all, with all their keys; asked for "color", it proposes another."""
    keys_by_kind = {kind: set(keys) for kind, keys in catalogue_data(()).items()}
    assert keys_by_kind == {kind: set(row["fields"]) for kind, row in CATALOGUE.items()}
    with pytest.raises(EffectError, match="no effect 'color'; did you mean 'colour'"):
        list(catalogue_lines(("color",)))
