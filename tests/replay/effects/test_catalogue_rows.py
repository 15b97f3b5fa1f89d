"""The contract of a row of the catalogue: it says all that is known of its effect."""

from copy import deepcopy
from importlib import resources

from replay.effects import CATALOGUE, EFFECTS, load_effect
from replay.effects.catalogue_text import example_of
from replay.effects.declaring import READERS, field_of

KEYS = {
    "about", "detector", "fields", "needs", "needs_if", "reads", "results", "retired", "single", "sources", "trigger",
    "uses",
}  # fmt: skip
COUNTED = ("fraction", "discharge", "press", "release")
"""Keys of numbers without a unit."""


def lacking(kind, row):
    """Lines that name what a row does not say."""
    lines = [f"{key} is no key of a row" for key in sorted(set(row) - KEYS)]
    if not (row.get("about", "").endswith(".") and row["about"][0].isupper()):
        lines.append("about is no sentence")
    if not row.get("sources"):
        lines.append("sources is missing")
    if not row.get("trigger") and not row.get("detector"):
        lines.append("trigger is missing")
    if not row.get("fields"):
        lines.append("fields is missing")
    for key, values in row.get("fields", {}).items():
        field = field_of(values)
        if field.kind not in READERS:
            lines.append(f"{key} is of no kind")
        if not field.about:
            lines.append(f"{key} has no meaning")
        if field.kind == "number" and not field.unit and not any(word in key for word in COUNTED):
            lines.append(f"{key} has no unit")
        if field.kind in ("number", "text") and field.default is None and not field.among and field.example is None:
            lines.append(f"{key} has no value to copy")
        elif field.kind in READERS and example_of(field) is None:
            lines.append(f"{key} has no example")
    if not resources.files("replay.effects").joinpath(f"{kind.replace('-', '_')}.py").is_file():
        lines.append("its file is missing")
    return lines


def test_every_row_of_the_effect_catalogue_is_complete():
    """A row of the catalogue describes a kind of effect: a sentence, sources, a trigger or a detector, and a module.

    Each of its fields has a meaning, a unit and an example; ``lacking`` lists what is missing. The spec that is made of
    the row has the same text and fields, and the other effects that it names are effects.
    """
    for kind in CATALOGUE:
        row = CATALOGUE[kind]
        assert lacking(kind, row) == [], kind
        spec = load_effect(kind)
        assert (spec.kind, spec.about, set(spec.fields)) == (kind, row["about"], set(row["fields"])), kind
        assert {*spec.needs, *spec.needs_if, *spec.uses} <= set(EFFECTS), kind


CHANGES = {
    "no about": (lambda row: row.pop("about"), "about is no sentence"),
    "no sources": (lambda row: row.pop("sources"), "sources is missing"),
    "no trigger": (lambda row: row.pop("trigger"), "trigger is missing"),
    "no fields": (lambda row: row.pop("fields"), "fields is missing"),
    "unknown key": (lambda row: row.update(colour="red"), "colour is no key of a row"),
    "no unit": (lambda row: row["fields"]["distance"].pop("unit"), "distance has no unit"),
    "no example": (lambda row: row["fields"]["distance"].pop("example"), "distance has no value to copy"),
    "no meaning": (lambda row: row["fields"].update(of={"body": ""}), "of has no meaning"),
}


def test_incomplete_row_of_the_effect_catalogue_is_named():
    """The row of hazard-proximity is complete; a ``change`` takes something out of it or puts something wrong in.

    ``lacking`` says so in this ``line``.
    """
    for case, (change, line) in CHANGES.items():
        row = deepcopy(CATALOGUE["hazard-proximity"])
        change(row)
        assert line in lacking("hazard-proximity", row), case


def test_a_row_without_a_file_is_named():
    """The row of contact is complete, but under the name of an effect of which there is no file evaporation.py."""
    assert lacking("evaporation", CATALOGUE["contact"]) == ["its file is missing"]


def test_each_rank_of_a_result_is_given_once():
    """Kinds of events that may be the result of an experiment have a rank in the catalogue; 1 is the weightiest."""
    ranks = [rank for row in CATALOGUE.values() for rank in row.get("results", {}).values()]
    assert len(ranks) == len(set(ranks)) and min(ranks) == 1
