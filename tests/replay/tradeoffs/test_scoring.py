from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cubes

from cdcore import Verdict
from cdcore.protocol import FaceSets
from replay.comparison.tolerance import TAU
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.errors import TradeoffError
from replay.prepare.assemble import assemble
from replay.tradeoffs.scoring import Scoring


@pytest.fixture(scope="module")
def assembly(bumped):
    return assemble(bumped)


def judged(assembly, spec, *, oracle="exact", faces=False, same_faces=True):
    scoring = Scoring(assembly, parse_detector(oracle), 0, TAU)
    detection = make_detector(parse_detector(spec), assembly, 0).detect(assembly.motion, faces=faces)
    return scoring.figures(detection, other=None if same_faces else assembly), detection, scoring


def test_the_oracle_beside_itself_misses_and_invents_nothing(assembly):
    told, detection, scoring = judged(assembly, "exact", faces=True)
    assert (told["both"], told["missed_pair_frames"], told["invented_pair_frames"]) == (3, 0, 0)
    assert (told["contacts"], told["contacts_missed"]) == (2, 0) == (len(scoring.contacts), 0)
    assert told["face_recall"] == 1.0 and told["face_pairs_invented"] == 0
    assert told["face_pairs"] == told["face_pairs_listed"] == len(np.concatenate(
        [detection.face_sets.at(frame, 0) for frame in (4, 8, 9)]
    ))  # fmt: skip


def test_booleans_and_faces_of_one_detector_find_the_same_contacts(assembly):
    booleans, faces = (judged(assembly, "hybrid", faces=asked)[0] for asked in (False, True))
    of_faces = {"face_recall", "face_pairs", "face_pairs_listed", "face_pairs_invented"}
    assert {key: value for key, value in booleans.items() if key not in of_faces} == {
        key: value for key, value in faces.items() if key not in of_faces
    }
    assert all(booleans[key] is None for key in of_faces) and faces["face_recall"] == 1.0


def test_face_pairs_of_a_missed_frame_are_missed(assembly):
    _, detection, scoring = judged(assembly, "exact", faces=True)
    verdict, sets = detection.verdict.copy(), detection.face_sets
    verdict[8, 0] = Verdict.CLEAR
    kept = [(frame, sets.at(frame, 0)) for frame in (4, 9)]
    blind = replace(
        detection, verdict=verdict, face_sets=FaceSets.from_lists([4, 9], [0, 0], [kept[0][1], kept[1][1][:5]])
    )
    told = scoring.figures(blind)
    assert (told["missed_pair_frames"], told["face_pairs"]) == (1, sum(len(sets.at(frame, 0)) for frame in (4, 8, 9)))
    assert told["face_pairs_listed"] == len(kept[0][1]) + 5
    assert told["face_recall"] == told["face_pairs_listed"] / told["face_pairs"]


@pytest.mark.parametrize("how", [{"same_faces": False}, {"oracle": "continuous"}])
def test_faces_of_other_meshes_or_of_an_oracle_of_intervals_are_not_compared(assembly, how):
    told, _, _ = judged(assembly, "hybrid", faces=True, **how)
    assert told["face_recall"] is None is told["face_pairs"] and told["both"] > 0


def test_a_session_without_contact_is_refused():
    with pytest.raises(TradeoffError, match="nothing can be missed"):
        Scoring(assemble(cubes({"a": [0, 0], "b": [3, 4]})), parse_detector("exact"), 0, TAU)
