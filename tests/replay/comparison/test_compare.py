import numpy as np
import pytest
from support.small_worlds import cubes, verdict_column, verdicts

from cdcore import Verdict
from cdcore.protocol import FaceSets
from replay.comparison.compare import FaceRecall, compare, face_recall
from replay.comparison.episodes import episodes
from replay.comparison.outcome import Comparison, Outcome
from replay.errors import AuditError
from replay.pipeline.engine import compute

LETTER = {
    Outcome.NEITHER: ".", Outcome.BOTH: "B", Outcome.MISSED: "M", Outcome.INVENTED: "I",
    Outcome.WITHIN_TOLERANCE: "t", Outcome.BETWEEN_FRAMES: "b", Outcome.LEFT_OUT: "-",
}  # fmt: skip


def words(subject, oracle, **more):
    return "".join(LETTER[Outcome(value)] for value in compare(subject, oracle, **more).outcome[:, 0])


def test_every_verdict_counts_as_the_glossary_says():
    for letter, counts in {".": False, "C": True, "I": True, "?": True, "n": False}.items():
        assert words(verdict_column(letter), verdict_column("C")) == ("B" if counts else "M")
        assert words(verdict_column(letter), verdict_column(".")) == ("I" if counts else ".")
    for letter in "u-":
        for other in ".CI?nu-":
            assert words(verdict_column(letter), verdict_column(other)) == "-"
            assert words(verdict_column(other), verdict_column(letter)) == "-"
    invalid = verdict_column("C")
    invalid = type(invalid)(**{**vars(invalid), "verdict": np.array([[Verdict.INVALID]], dtype=np.uint8)})
    assert words(invalid, verdict_column("C")) == "-"


def test_what_intervals_find_beyond_instants_is_between_frames_never_invented():
    subject, oracle = verdict_column("..CCC.", covers="intervals"), verdict_column("...C..")
    assert words(subject, oracle) == "..bBb."


def test_against_intervals_a_contact_found_at_either_end_is_found():
    subject, oracle = verdict_column(".CC....", covers="instants"), verdict_column(".CCC.C.", covers="intervals")
    assert words(subject, oracle) == ".BBB.M."


def test_within_tolerance_only_disagreement_is_excused():
    subject, oracle = verdict_column("..CC"), verdict_column(".C.C")
    assert words(subject, oracle, within=lambda frames, _: frames >= 0) == ".ttB"
    assert words(subject, oracle, within=lambda frames, _: frames < 0) == ".MIB"


def test_labels_are_the_runs_else_the_detectors():
    a, b = verdict_column("C", name="x"), verdict_column("C", name="y")
    assert (compare(a, b).subject, compare(a, b).oracle) == ("x", "y")
    assert (compare(a, b, ("p", "q")).subject, compare(a, b, ("p", "q")).oracle) == ("p", "q")


def test_other_frames_or_pairs_are_refused():
    with pytest.raises(AuditError, match=r"different frames \(2 and 3\)"):
        compare(verdict_column(".."), verdict_column("..."))
    with pytest.raises(AuditError, match="different frames"):
        compare(verdict_column(".."), verdict_column("..", step=0.02))
    with pytest.raises(AuditError, match="different pairs"):
        compare(verdicts(["..", ".."]), verdict_column(".."))


def test_counts_over_all_outcomes_make_up_every_pair_frame():
    outcome = np.random.default_rng(0).integers(0, len(Outcome), size=(50, 4)).astype(np.uint8)
    comparison = Comparison("a", "b", outcome)
    assert sum(comparison.count(word) for word in Outcome) == outcome.size
    assert comparison.count(Outcome.MISSED) == (outcome == 2).sum()


def test_pairs_of_faces_are_compared_where_both_decided_and_missed_frames_count():
    truth = FaceSets.from_lists([0, 1, 2], [0, 0, 0], [np.array([[0, 1], [0, 2]])] * 3)
    said = FaceSets.from_lists([0, 2], [0, 0], [np.array([[0, 2], [1, 1]]), np.array([[0, 1], [0, 2]])])
    subject, oracle = verdict_column("C.-"), verdict_column("CCC")
    recall = face_recall(said, truth, compare(subject, oracle), episodes(oracle))
    assert recall == FaceRecall(found=(1,), total=(4,), pair_frames=2, invented=1)


def test_pairs_of_faces_are_counted_contact_by_contact():
    lists = [np.array([[k, 1], [k, 2]]) for k in range(4)]
    truth = FaceSets.from_lists([0, 0, 1, 3], [0, 1, 1, 0], lists)
    said = FaceSets.from_lists([0, 1, 3], [0, 1, 0], [lists[0], lists[2][:1], lists[3]])
    oracle = verdicts(["CC", ".C", "..", "C."])
    recall = face_recall(said, truth, compare(oracle, oracle), episodes(oracle))
    assert (recall.found, recall.total) == ((2, 1, 2), (2, 4, 2))


@pytest.mark.parametrize(("detector", "recall"), [("hybrid", 1.0), ("slow=discrete[rate_hz=20]", None)])
def test_a_run_compares_faces_when_asked(detector, recall):
    session = cubes({"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]})
    result = compute(session, detectors=detector, oracle="exact", faces=True)
    (figures,) = result.summary["audit"].values()
    told = figures["faces"]
    assert told["pair_frames"] == 4 and told["recall"]["of"] == result.detections["exact"].face_counts.sum()
    assert told["recall"]["share"] == recall if recall else told["recall"]["share"] < 0.9


def test_a_detector_without_faces_and_a_run_that_did_not_ask_say_nothing():
    session = cubes({"a": [0, 0], "b": [3, 0.9]})
    assert compute(session, detectors="sphere", faces=True).summary["audit"]["sphere"]["faces"] is None
    assert compute(session, detectors="hybrid").summary["audit"]["hybrid"]["faces"] is None
