"""One table of what no reader and no function takes, `bad_input.toml`: each ends in one sentence."""

import re
import tomllib
from pathlib import Path

import pytest
from support.small_worlds import unit_cubes_on_x
from support.study_samples import codebook

from replay.auditing.tolerance import Tolerance
from replay.detection.detector_spec import parse_detector, parse_detectors
from replay.document.gates import Gates
from replay.effects import load_effect
from replay.effects.vessels import Vessel
from replay.engine import compute
from replay.errors import ReplayError
from replay.prepare.kinematics import Kinematics
from replay.prepare.noise import parse_noise
from replay.prepare.pair_choice import chosen_pairs
from replay.prepare.policy import parse_policy
from replay.settings import RunSettings
from replay.studies.class_study.class_runs import read_students
from replay.studies.class_study.codebook import read_codebook
from replay.studies.class_study.joining import read_questionnaire
from replay.studies.class_study.published import check_published
from replay.studies.stress.runner import numbers_of, stress
from replay.studies.synthetic_sessions import synthetic_session
from sessions.errors import SessionError
from sessions.model.scene import Scene, SceneBody

TABLE = tomllib.loads(Path(__file__).with_name("bad_input.toml").read_text(encoding="utf-8"))["refused"]
SEPARATE = {"a": range(11), "b": [50] * 11}
"""X of two unit cubes in 11 frames, which never meet."""

CIRCLE = Scene(bodies=(SceneBody("a", parent="b"), SceneBody("b", parent="a")))
"""A scene in which each body carries the other."""

CALLS = {
    "detector": lambda given: parse_detector(tuple(given) if isinstance(given, list) else given),
    "detectors": parse_detectors,
    "settings": lambda settings: RunSettings(**settings),
    "gates": lambda limits: Gates(**limits),
    "tolerance": lambda tau: Tolerance(assembly=None, faces=None, tau=tau),
    "noise": lambda words: parse_noise([words]),
    "noisy copies": lambda count: parse_noise(["vive"], count),
    "run": lambda settings: compute(unit_cubes_on_x(SEPARATE), **{"detectors": "hybrid", **settings}),
    "pair": lambda pair: chosen_pairs(Scene(), ("hand",), {}, [pair]),
    "parents": lambda tracked: Kinematics(CIRCLE, tuple(tracked), ("a",)),
    "policy": lambda word: parse_policy([word]),
    "vessel": lambda keys: Vessel(SceneBody("a", **keys)),
    "effect": load_effect,
    "families": lambda text: numbers_of(text, "family", range(1, 27)),
    "stress": lambda settings: stress("exact", families=(), **{"pairs": 1, **settings}),
    "made-up session": synthetic_session,
}
"""What a row of the table is ``of``: the function that gets what is given."""

READERS = {
    "codebook": read_codebook,
    "questionnaire": lambda path: read_questionnaire(path, codebook()),
    "students": read_students,
    "printed table": check_published,
}
"""What a row of the table is ``of``: the function that reads a file with what is given."""


def error_of(name, value, path):
    """The error in which a function of CALLS, or a reader of READERS, refuses a value; None if it takes it."""
    try:
        if name in READERS:
            path.write_text(value, encoding="utf-8")
            READERS[name](path)
        else:
            CALLS[name](value)
    except (ReplayError, SessionError) as error:
        return error
    return None


@pytest.mark.parametrize("row", TABLE, ids=[f"{row['of']}: {row['words']}"[:60] for row in TABLE])
def test_bad_input_is_refused_in_a_sentence_with_its_cure(tmp_path, row):
    """A row of bad_input.toml: a reader or function, all that it refuses, its error, and a pattern of the message.

    The message has no line breaks and no control characters.
    """
    assert row["given"]
    for value in row["given"]:
        error = error_of(row["of"], value, tmp_path / "given")
        message = str(error)
        assert type(error).__name__ == row["error"], value
        assert message.isprintable(), value
        assert re.search(row["words"], message), (value, message)
