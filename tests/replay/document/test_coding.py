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


def changed(plain, path, value):
    """Write another value into a document."""
    inside, key = container_of(plain, path)
    inside[key] = value


def removed(plain, path):
    """Take a key out of a document."""
    inside, key = container_of(plain, path)
    del inside[key]


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    "settings",
    [
        {"detectors": "slow=discrete[rate_hz=20],sphere,hybrid-qaco,collider"},
        {"detectors": "exact", "oracle": "continuous"},
        {"detectors": "hybrid", "oracle": "none"},
        {"detectors": "sphere", "noise": "vive", "noise_copies": 2},
        {"detectors": ()},
    ],
)
def test_run_document_survives_writing_and_reading_as_json(settings):
    """Runs with and without reference, noise or detectors: read and written again the text is the same.

    It fits the schema too.
    """
    text = text_of(compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **settings))
    document, problems = document_of(json.loads(text))
    assert problems == ()
    assert json_of(document) == text
    assert [error.message for error in VALIDATOR.iter_errors(json.loads(text))] == []


@pytest.mark.parametrize("path", TAMPERED)
def test_a_tampered_value_is_named_with_its_path(plain_document, path):
    """A row of TAMPERED: the path of a value, what stands there instead, and what the problem says of it."""
    value, reason = TAMPERED[path]
    bad = copy.deepcopy(plain_document)
    changed(bad, path, value)
    assert document_of(bad) == (None, (f"{path}: {reason}",))
    assert not VALIDATOR.is_valid(bad)


def test_every_tampered_value_is_named(plain_document):
    """All rows of TAMPERED at once."""
    bad = copy.deepcopy(plain_document)
    for path, (value, _) in TAMPERED.items():
        changed(bad, path, value)
    document, problems = document_of(bad)
    assert document is None
    assert sorted(problems) == sorted(f"{path}: {reason}" for path, (_, reason) in TAMPERED.items())


def test_every_missing_key_is_named(plain_document):
    bad = copy.deepcopy(plain_document)
    paths = ["session.frames", "audit.slow.pair_frames.both", "tau", "detectors.slow.seconds.stages"]
    for path in paths:
        removed(bad, path)
    assert sorted(document_of(bad)[1]) == sorted(f"{path}: is missing" for path in paths)


def test_document_with_detectors_foreign_to_its_run_is_faulted(plain_document):
    """The audit of ``slow`` is renamed to ``quick``, and the reference to ``truth``, which the run does not have."""
    bad = copy.deepcopy(plain_document)
    bad["audit"]["quick"] = bad["audit"].pop("slow")
    bad["oracle"] = "truth"
    _, problems = document_of(bad)
    assert problems == (
        "audit.quick: no detector of the run has this name",
        "oracle: no detector of the run is called 'truth'",
        "answers: they are about other detectors than those audited",
    )


def test_run_document_ignores_unknown_keys(plain_document):
    """Keys of a later version are left out when the document is written again."""
    more = copy.deepcopy(plain_document) | {"surprise": 1}
    more["audit"]["slow"]["surprise"] = 1
    assert json.loads(json_of(document_of(more)[0])) == plain_document


@pytest.mark.parametrize("plain", [None, [], 3, "text", {}])
def test_json_of_another_kind_is_refused_with_problems(plain):
    document, problems = document_of(plain)
    assert document is None
    assert problems


def test_the_schema_is_valid():
    Draft202012Validator.check_schema(json_schema())
