"""The document of a run is what is written, its schema comes from its types, and every problem is named."""

import copy
import json

import pytest
from jsonschema import Draft202012Validator
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay.document.coding import document_of, json_of, json_schema
from replay.engine import compute
from sessions.synthetic.analytic import make_analytic

VALIDATOR = Draft202012Validator(json_schema())

TAMPERED = {
    "audit.slow.time_missed.value": (1.5, "expected float <= 1.0"),
    "audit.slow.pair_frames.missed": (-1, "expected int >= 0"),
    "audit.slow.between_frames": (0.5, "expected int | str, got float"),
    "detectors.slow.digest": ("short", "expected str matching regex '^[0-9a-f]{64}$'"),
    "detectors.slow.seconds.detect": (None, "expected float, got null"),
    "session.bodies.ball.faces": (0, "expected int >= 1"),
    "window.start": ("0", "expected float | null, got str"),
    "answers.0.moment.pair.1": (3, "expected str, got int"),
    "machine": ([], "expected object, got array"),
}
"""Dotted path of a value in the document of a run -> a wrong value, and what the problem with it says."""


def text_of(result):
    """The document of a run as it is written."""
    return json_of(result.document)


@pytest.fixture(scope="module")
def plain_document():
    """The document of a run as JSON's dicts and lists; it audits a detector ``slow`` against ``hybrid``."""
    return json.loads(
        text_of(compute(make_analytic("fast-ball", seconds=1.0)[0], detectors="slow=discrete[rate_hz=20]"))
    )


def container_of(plain, path):
    """The dictionary or list that holds a dotted path of a document, and the key in it."""
    *above, key = path.split(".")
    for name in above:
        plain = plain[int(name) if isinstance(plain, list) else name]
    return plain, int(key) if isinstance(plain, list) else key


def replaced(document, path, value):
    """A copy of the document with another value at a dotted path."""
    copied = copy.deepcopy(document)
    container, key = container_of(copied, path)
    container[key] = value
    return copied


def without(document, path):
    """A copy of the document that lacks the key at a dotted path."""
    copied = copy.deepcopy(document)
    container, key = container_of(copied, path)
    del container[key]
    return copied


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    "settings",
    [
        pytest.param({"detectors": "slow=discrete[rate_hz=20],sphere,hybrid-qaco,collider"}, id="four detectors"),
        pytest.param({"detectors": "exact", "oracle": "continuous"}, id="reference of whole intervals"),
        pytest.param({"detectors": "hybrid", "oracle": "none"}, id="no reference"),
        pytest.param({"detectors": "sphere", "noise": "vive", "noise_copies": 2}, id="copies with noise"),
        pytest.param({"detectors": ()}, id="no detectors"),
    ],
)
def test_run_document_survives_writing_and_reading_as_json(settings):
    """The document of a run of two cubes, read from its text and written again, is the same text, without a problem.

    The text fits the JSON schema too.
    """
    text = text_of(compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **settings))
    document, problems = document_of(json.loads(text))
    assert problems == ()
    assert json_of(document) == text
    assert [error.message for error in VALIDATOR.iter_errors(json.loads(text))] == []


def test_number_that_is_not_finite_is_never_written():
    """JSON has neither infinity nor NaN."""
    for value in (float("nan"), float("inf"), -float("inf")):
        with pytest.raises(ValueError, match="not JSON compliant"):
            pytest.fail(f"{value} was written as {json_of({'gap': value})}")


@pytest.mark.parametrize("path", TAMPERED)
def test_a_tampered_value_is_named_with_its_path(plain_document, path):
    """One value of a run's document is wrong: it is not read, the problem has its path, and the schema does not fit."""
    value, reason = TAMPERED[path]
    tampered = replaced(plain_document, path, value)
    assert document_of(tampered) == (None, (f"{path}: {reason}",))
    assert not VALIDATOR.is_valid(tampered)


def test_every_tampered_value_is_named(plain_document):
    """All wrong values of TAMPERED stand in one document of a run: there is a problem for each."""
    tampered = plain_document
    for path, (value, _) in TAMPERED.items():
        tampered = replaced(tampered, path, value)
    document, problems = document_of(tampered)
    assert document is None
    assert sorted(problems) == sorted(f"{path}: {reason}" for path, (_, reason) in TAMPERED.items())


def test_every_missing_key_is_named(plain_document):
    """Four keys are taken out of the document of a run, at its top and deep in it."""
    paths = ["session.frames", "audit.slow.pair_frames.both", "tau", "detectors.slow.seconds.stages"]
    incomplete = plain_document
    for path in paths:
        incomplete = without(incomplete, path)
    document, problems = document_of(incomplete)
    assert document is None
    assert sorted(problems) == sorted(f"{path}: is missing" for path in paths)


def test_document_with_detectors_foreign_to_its_run_is_faulted(plain_document):
    """The audit of ``slow`` is renamed to ``quick``, and the reference to ``truth``: the run has neither."""
    foreign = copy.deepcopy(plain_document)
    foreign["audit"]["quick"] = foreign["audit"].pop("slow")
    foreign["oracle"] = "truth"
    document, problems = document_of(foreign)
    assert document is None
    assert problems == (
        "audit.quick: no detector of the run has this name",
        "oracle: no detector of the run is called 'truth'",
        "answers: they are about other detectors than those audited",
    )


def test_run_document_ignores_unknown_keys(plain_document):
    """Keys of a later version, at the top and in an audit, are left out when the document is written again."""
    later = copy.deepcopy(plain_document) | {"surprise": 1}
    later["audit"]["slow"]["surprise"] = 1
    document, problems = document_of(later)
    assert problems == ()
    assert json.loads(json_of(document)) == plain_document


@pytest.mark.parametrize("plain", [None, [], 3, "text", {}])
def test_json_of_another_kind_is_refused_with_problems(plain):
    """``plain``: what the JSON text holds in place of a document."""
    document, problems = document_of(plain)
    assert document is None
    assert problems


def test_the_schema_is_valid():
    """The schema of a run's document keeps to the meta-schema of JSON Schema, draft 2020-12."""
    Draft202012Validator.check_schema(VALIDATOR.schema)
