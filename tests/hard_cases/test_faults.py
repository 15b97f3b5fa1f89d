"""A few of the faults that a machine brings; all of them: ``PYTHONPATH=.:tests python -m support.faults FOLDER``."""

import sys

import pytest
from support.fault_grounds import BYSTANDER, VERBS, WORDS, Ended, Place, bytes_of, faults_of
from support.faults import KINDS, SURROUNDINGS, tried

CHOSEN = {
    "kills": [*range(len(VERBS) + 1)],
    "full disks": [0, 1, 2, 3, len(VERBS)],
    "file sizes": [0, 2, 3],
    "memory": [0, 3, 17],
    "surroundings": [k for k, name in enumerate(SURROUNDINGS) if "cache" not in name],
    "races": [0, 1, 2],
    "compilers": [],
}
"""Numbers of each kind; those that compile are left to the whole."""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return Place(tmp_path_factory.mktemp("faults"))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no signal kills there, and no limit is known")
@pytest.mark.parametrize("kind", [kind for kind, numbers in CHOSEN.items() if numbers])
def test_a_fault_leaves_one_sentence_and_no_torn_lost_or_foreign_file(place, kind):
    assert tried(place, kind, CHOSEN[kind]) == []


def test_every_kind_of_fault_has_its_tests():
    elsewhere = {"mutants", "files made by hand"}  # tests/hard_cases/test_fuzz.py
    assert CHOSEN.keys() | elsewhere == KINDS.keys()


COMPLAINTS = [
    (Ended(1, "Traceback"), BYSTANDER, WORDS, "traceback"),
    (Ended(-11, ""), BYSTANDER, WORDS, "ended with -11"),
    (Ended(1, "error: no"), BYSTANDER, "", "of somebody else"),
    (Ended(1, "error: no"), ".made.x", "", "left .made.x"),
    (Ended(1, "error: no"), "made.mcap", "torn", "made.mcap is torn"),
    (Ended(0, ""), BYSTANDER, WORDS, "made nothing"),
]
"""How a command ended, a file it left, its text, and what is said of it."""


@pytest.mark.parametrize(("ended", "file", "data", "said"), COMPLAINTS)
def test_a_verb_that_ends_badly_or_leaves_something_is_noticed(place, ended, file, data, said):
    work = place.fresh("recover", earlier=False)
    before = bytes_of(work)
    assert faults_of("recover", work, Ended(1, "error: no"), before) == []
    (work / file).write_text(data)
    assert any(said in one for one in faults_of("recover", work, ended, before))
