"""The output of `replay scene effects` is whole, fits a terminal, and can be copied."""

import tomllib

import pytest

from replay.effects import CATALOGUE
from replay.effects.catalogue_text import catalogue_data, catalogue_lines, example_of, fields_of, toml_of
from replay.effects.declaring import READERS
from replay.errors import EffectError
from sessions.model.scene import Scene, SceneBody

SCENE = Scene(bodies=(SceneBody("flask", tags=("glass",)), SceneBody("left", tags=("hand",))))


@pytest.mark.parametrize("kind", CATALOGUE)
def test_every_key_is_printed_with_its_meaning_in_eighty_columns(kind):
    lines = list(catalogue_lines((kind,)))
    text = " ".join(" ".join(lines).split())
    for key, row in CATALOGUE[kind]["fields"].items():
        assert f"{key} = " in text and next(iter(row.values())) in text
    assert max(map(len, lines)) <= 80 and lines[0].startswith(f"{kind}: ")


@pytest.mark.parametrize(("kind", "key"), [(kind, key) for kind in CATALOGUE for key in CATALOGUE[kind]["fields"]])
def test_every_example_is_toml_that_the_effect_accepts(kind, key):
    field = fields_of(kind)[key]
    value = tomllib.loads(f"{key} = {toml_of(example_of(field))}")[key]
    READERS[field.kind](value, field, SCENE)


def test_an_unknown_kind_is_refused():
    assert set(catalogue_data(())) == set(CATALOGUE)
    assert sum(len(keys) for keys in catalogue_data(()).values()) == sum(
        len(row["fields"]) for row in CATALOGUE.values()
    )
    with pytest.raises(EffectError, match="no effect 'color'; did you mean 'colour'"):
        list(catalogue_lines(("color",)))
