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


@pytest.mark.parametrize("kind", CATALOGUE)
def test_every_key_is_printed_with_its_meaning_in_eighty_columns(kind):
    """``replay scene effects`` prints these lines."""
    lines = list(catalogue_lines((kind,)))
    text = " ".join(" ".join(lines).split())
    for key, row in CATALOGUE[kind]["fields"].items():
        assert f"{key} = " in text and next(iter(row.values())) in text
    assert max(map(len, lines)) <= 80 and lines[0].startswith(f"{kind}: ")


@pytest.mark.parametrize("kind", CATALOGUE)
def test_every_example_is_toml_that_the_effect_accepts(kind):
    """The value to copy that is printed for a key, read as that of a scene is."""
    for key in CATALOGUE[kind]["fields"]:
        field = fields_of(kind)[key]
        value = tomllib.loads(f"{key} = {toml_of(example_of(field))}")[key]
        READERS[field.kind](value, field, SCENE)


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


@pytest.mark.parametrize("row", TOGETHER)
def test_all_examples_of_an_effect_make_a_scene(row):
    """The table of an effect gets the example of each of its keys, but for keys that are an alternative to others."""
    name, alternatives, absent = TOGETHER[row]
    fields = fields_of(TABLES[name]["kind"]).items()
    chosen = {key: field for key, field in fields if field.kind not in ("body", "bodies", "pairs")}
    examples = {key: tomllib.loads(f"x = {toml_of(example_of(field))}")["x"] for key, field in chosen.items()}
    changes = {f"{name}.{key}": value for key, value in examples.items() if key not in alternatives}
    if changes.get(f"{name}.species") == "MnO4-":
        changes["flask.properties.liquid.solutes.KMnO4"] = 0.01  # an ion that nobody brings has no colour
    assert plan(scene_with_changes(changes, absent)).effects


def test_key_without_a_default_is_required_unless_optional():
    """A threshold has to be declared; ``surface_c`` is optional; an amount that counts as a pour has a default."""
    keys = {
        kind: {key for key, row in rows.items() if row["required"]}
        for kind, rows in catalogue_data(("burn-exposure", "pour")).items()
    }
    assert keys == {"burn-exposure": {"between", "threshold_c", "seconds"}, "pour": {"from"}}


def test_no_kind_prints_all_and_an_unknown_is_refused():
    """Without a kind all are printed, with all their keys."""
    assert set(catalogue_data(())) == set(CATALOGUE)
    assert sum(len(keys) for keys in catalogue_data(()).values()) == sum(
        len(row["fields"]) for row in CATALOGUE.values()
    )
    with pytest.raises(EffectError, match="no effect 'color'; did you mean 'colour'"):
        list(catalogue_lines(("color",)))
