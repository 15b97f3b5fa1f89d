import numpy as np
from support.small_worlds import cubes

from replay.pipeline.engine import compute
from replay.studies.minimise.changes import Changes, Difference, changes
from replay.studies.minimise.names import Names
from replay.studies.minimise.session import minimise
from sessions.scene_files.scene_toml import parse_scene

PLACES = {"anna": [0.0] * 6, "beaker": [3, 1.0, 0.9, 1.1, 1.0 + 1e-7, 1.0 - 1e-7]}


def verdicts(session):
    return compute(session, detectors="exact", oracle="none").detections["exact"].verdict


def test_nothing_changes_where_only_time_and_words_do():
    before = cubes(PLACES)
    made = minimise(before, keep=["place"])
    found = changes(before, made.session, made.names)
    assert (found.pair_frames, found.contacts, found.differences) == (6, 3, ())
    assert verdicts(before).tobytes() == verdicts(made.session).tobytes()


def test_every_pair_frame_that_differs_is_listed_and_judged():
    before, after = cubes(PLACES), cubes({**PLACES, "beaker": [3, 1.0, 1.2, 1.1, 1.0 - 1e-7, 1.0 + 1e-7]})
    names = Names()
    found = changes(before, minimise(after, keep=["place"]).session, names)
    expected = np.argwhere(verdicts(before) != verdicts(after))[:, 0].tolist()
    assert [one.frame for one in found.differences] == expected == [2, 4, 5]
    assert [one.within_tau for one in found.differences] == [False, True, True]
    assert {one.pair for one in found.differences} == {"beaker-body-1"}
    assert found.differences[0].before == "CONTACT" and found.differences[0].after == "CLEAR"


def test_a_pair_that_is_asked_no_more_is_named():
    pairs = '[[body]]\nid = "a"\n[[body]]\nid = "b"\n[[body]]\nid = "cup"\n[[pair]]\nbetween = ["a", "b"]\n'
    places = {"a": [0.0] * 3, "b": [3, 0.9, 3], "cup": [9, 0.8, 9]}
    every = cubes(places, scene=parse_scene(f'{pairs}[[pair]]\nbetween = ["a", "cup"]\n'))
    found = changes(every, cubes(places, scene=parse_scene(pairs)), Names())
    assert (found.gone, found.new, found.pair_frames) == (("a-cup",), (), 3)


def test_the_sentences_say_every_count():
    clear = Changes(1200, 7, (), (), ())
    assert [*clear.sentences()] == ["contacts by exact: 0 of 1,200 pair-frames differ; 7 were contact"]
    one = Difference(3, 0.03, "a-b", "CONTACT", "CLEAR", True)
    two = Difference(4, 0.04, "a-b", "CLEAR", "CONTACT", False)
    assert [*Changes(9, 2, (one, two), ("a-c",), ("b-c",)).sentences()] == [
        "contacts by exact: 2 of 9 pair-frames differ; 2 were contact; 1 of the 2 are within tolerance",
        "  frame 3 at 0.030 s, a-b: CONTACT became CLEAR (within tolerance)",
        "  frame 4 at 0.040 s, a-b: CLEAR became CONTACT",
        "asked only before: a-c", "asked only after: b-c",
    ]  # fmt: skip
