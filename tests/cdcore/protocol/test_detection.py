"""A detection's digests depend on what was found, and not on how bodies and pairs were ordered or blocks were cut."""

from __future__ import annotations

import numpy as np
import pytest

from cdcore import Detection, FaceSets, join
from cdcore.errors import NotRecordedError

FACES = np.array([[1, 7], [2, 3]])


def detection(**changes):
    values = {
        "detector": "test",
        "names": ("cup", "rod", "table"),
        "pairs": np.array([[0, 1], [1, 2]]),
        "times": np.array([0.0, 0.5, 1.0]),
        "verdict": np.array([[0, 1], [1, 7], [2, 0]], dtype=np.uint8),
        "face_sets": FaceSets.from_lists([0, 1], [1, 0], [FACES[:1], FACES]),
    }
    return Detection(**(values | changes))


def turned():
    """The same finding, bodies in another order and pairs the other way round."""
    swapped = np.array([[3, 2], [7, 1]])
    return detection(
        names=("table", "cup", "rod"),
        pairs=np.array([[0, 2], [2, 1]]),
        verdict=detection().verdict[:, ::-1].copy(),
        face_sets=FaceSets.from_lists([0, 1], [0, 1], [np.array([[7, 1]]), swapped]),
    )


def test_digests_do_not_depend_on_the_order_of_bodies_and_pairs():
    assert detection().digest == turned().digest
    assert detection().faces_digest == turned().faces_digest


@pytest.mark.parametrize(
    "change",
    [
        {"verdict": np.array([[0, 1], [1, 7], [1, 0]], dtype=np.uint8)},
        {"times": np.array([0.0, 0.5, 1.0000000000000002])},
        {"names": ("cup", "rod", "desk")},
        {"covers": "intervals"},
    ],
)
def test_a_digest_changes_with_any_verdict_stamp_or_name(change):
    assert detection(**change).digest != detection().digest


def test_the_faces_digest_changes_with_one_face():
    other = FaceSets.from_lists([0, 1], [1, 0], [FACES[:1], np.array([[1, 7], [2, 4]])])
    assert detection(face_sets=other).faces_digest != detection().faces_digest
    assert detection(face_sets=other).digest == detection().digest


def test_stored_rows_that_are_shared_give_the_digest_of_rows_that_are_not():
    plain = FaceSets.from_lists([0, 1], [0, 0], [FACES, FACES])
    shared = FaceSets.from_shared(np.array([0, 1]), np.array([0, 0]), np.array([0, 0]), [FACES])
    assert detection(face_sets=plain).faces_digest == detection(face_sets=shared).faces_digest


def test_a_budget_in_seconds_has_no_digest():
    assert detection(reproducible=False).digest is None
    assert detection(reproducible=False).faces_digest is None


def test_what_was_not_recorded_is_named():
    bare = detection(face_sets=None)
    with pytest.raises(NotRecordedError, match=r"'test' holds no face pairs; call detect\(motion, faces=True\)"):
        _ = bare.face_counts
    with pytest.raises(NotRecordedError, match="no intersection segments"):
        detection().section(1, 0)


def test_faces_are_found_by_frame_and_pair_and_negative_numbers_count_from_the_end():
    assert detection().faces(1, 0).tolist() == FACES.tolist()
    assert detection().faces(-2, -2).tolist() == FACES.tolist()
    assert detection().faces(2, 0).shape == (0, 2)
    assert detection().face_counts.tolist() == [[0, 1], [2, 0], [0, 0]]
    with pytest.raises(IndexError, match="there are 3 frames and 2 pairs"):
        detection().faces(3, 0)


def block(start, stop, **changes):
    whole = detection()
    sets = [(t, p, whole.faces(t, p)) for t in range(start, stop) for p in range(2) if len(whole.faces(t, p))]
    return detection(
        times=whole.times[start:stop],
        verdict=whole.verdict[start:stop].copy(),
        face_sets=FaceSets.from_lists(
            [t - start for t, _, _ in sets], [p for _, p, _ in sets], [f for _, _, f in sets]
        ),
        work={"tests": stop - start, "per frame": np.arange(start, stop, dtype=np.uint32)},
        seconds={"all": 0.5},
        section_source=lambda frame, pair, faces: np.full((len(faces), 2, 3), float(start + frame)),
        **changes,
    )


def test_joined_blocks_are_the_whole():
    joined = join([block(0, 1), block(1, 3, reasons={(1, 0): "why"}, toi={(0, 1): (0.1, 0.2)})])
    assert joined.digest == detection().digest
    assert joined.faces_digest == detection().faces_digest
    assert joined.work["tests"] == 3
    assert joined.work["per frame"].tolist() == [0, 1, 2]
    assert joined.seconds["all"] == 1.0
    assert joined.reasons == {(2, 0): "why"}
    assert joined.toi == {(1, 1): (0.1, 0.2)}
    assert joined.section(1, 0)[0, 0, 0] == 1.0
    assert joined.section(0, 1).shape == (1, 2, 3)


def test_a_joined_result_is_reproducible_only_if_all_blocks_are():
    assert join([block(0, 1), block(1, 3, reproducible=False)]).digest is None


def test_no_blocks_cannot_be_joined():
    with pytest.raises(ValueError, match="no block to join"):
        join([])


def test_verdicts_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        detection().verdict[0, 0] = 1
