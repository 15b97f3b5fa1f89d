"""A detection is checked and frozen; verdicts count as contact, as none, or are left out; face sets come back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdcore import Detection, FaceSets, Verdict, join
from cdcore.errors import NotRecordedError
from cdcore.protocol import counts_as_contact, is_undecided

FACE_PAIRS = np.array([[1, 7], [2, 3]])


def sets_of(frame, pair, sets):
    """Sets of face pairs, one for each frame and pair."""
    return FaceSets.from_shared(*np.array([frame, pair, range(len(sets))], dtype=np.int64), sets)


def detection(**changes):
    """A detection of two pairs of three bodies in three frames, but for ``changes``."""
    values = {
        "detector": "test",
        "names": ("cup", "rod", "table"),
        "pairs": np.array([[0, 1], [1, 2]]),
        "times": np.array([0.0, 0.5, 1.0]),
        "verdict": np.array([[0, 1], [1, 7], [2, 0]], dtype=np.uint8),
        "face_sets": sets_of([0, 1], [1, 0], [FACE_PAIRS[:1], FACE_PAIRS]),
    }
    return Detection(**(values | changes))


def same_in_another_order():
    """The same finding, bodies in another order and pairs the other way round."""
    swapped = np.array([[3, 2], [7, 1]])
    return detection(
        names=("table", "cup", "rod"),
        pairs=np.array([[0, 2], [2, 1]]),
        verdict=detection().verdict[:, ::-1].copy(),
        face_sets=sets_of([0, 1], [0, 1], [np.array([[7, 1]]), swapped]),
    )


def test_digests_ignore_the_order_of_bodies_and_pairs():
    """The other detection has its bodies in another order, and the bodies of each pair swapped."""
    assert detection().digest == same_in_another_order().digest
    assert detection().faces_digest == same_in_another_order().faces_digest


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
    """One verdict, a stamp by one rounding, a name, or what the rows speak of."""
    assert detection(**change).digest != detection().digest


def test_faces_digest_changes_with_a_single_face():
    """The other detection has face 4 where this one has face 3, in one pair of faces."""
    other = sets_of([0, 1], [1, 0], [FACE_PAIRS[:1], np.array([[1, 7], [2, 4]])])
    assert detection(face_sets=other).faces_digest != detection().faces_digest
    assert detection(face_sets=other).digest == detection().digest


def test_faces_or_segments_never_requested_raise_an_error():
    """A detection without lists of faces, and one with faces but without segments."""
    bare = detection(face_sets=None)
    with pytest.raises(NotRecordedError, match=r"'test' holds no face pairs; call detect\(motion, faces=True\)"):
        _ = bare.face_counts
    with pytest.raises(NotRecordedError, match="no intersection segments"):
        detection().section(1, 0)


def test_faces_are_indexed_by_frame_and_pair():
    """Frame 0 has a pair of faces in pair 1, frame 1 has two in pair 0; negative numbers count from the end."""
    assert detection().faces(1, 0).tolist() == FACE_PAIRS.tolist()
    assert detection().faces(-2, -2).tolist() == FACE_PAIRS.tolist()
    assert detection().faces(2, 0).shape == (0, 2)
    assert detection().face_counts.tolist() == [[0, 1], [2, 0], [0, 0]]
    with pytest.raises(IndexError, match="there are 3 frames and 2 pairs"):
        detection().faces(3, 0)


def test_detection_of_selected_frames_equals_the_whole_there():
    """Frames 1 and 2 of three are taken, so frame k of the component is frame k + 1 of the whole."""
    whole = detection(reasons={(1, 1): "lost", (2, 0): "late"}, toi={(2, 1): (0.5, 1.0)})
    component = whole.take(np.array([1, 2]))
    assert np.array_equal(component.times, whole.times[1:])
    assert np.array_equal(component.verdict, whole.verdict[1:])
    assert component.reasons == {(0, 1): "lost", (1, 0): "late"} and component.toi == {(1, 1): (0.5, 1.0)}
    for frame in range(2):
        for pair in range(2):
            assert np.array_equal(component.faces(frame, pair), whole.faces(frame + 1, pair))
    assert whole.take(np.array([], dtype=np.int64)).face_counts.shape == (0, 2)


def detection_of_frames(start, stop, **changes):
    """Some frames of that detection as a block of a stream."""
    whole = detection()
    sets = [(t, p, whole.faces(t, p)) for t in range(start, stop) for p in range(2) if len(whole.faces(t, p))]
    return detection(
        times=whole.times[start:stop],
        verdict=whole.verdict[start:stop].copy(),
        face_sets=sets_of([t - start for t, _, _ in sets], [p for _, p, _ in sets], [f for _, _, f in sets]),
        work={"tests": stop - start, "per frame": np.arange(start, stop, dtype=np.uint32)},
        seconds={"all": 0.5},
        section_source=lambda frame, pair, faces: np.full((len(faces), 2, 3), float(start + frame)),
        **changes,
    )


def test_detections_of_consecutive_blocks_join_to_the_whole():
    """A block of frame 0, and one of frames 1 and 2, whose frame numbers shift by 1.

    Segments of a contact have the frame's number as their coordinates.
    """
    joined = join(
        [
            detection_of_frames(start=0, stop=1),
            detection_of_frames(start=1, stop=3, reasons={(1, 0): "why"}, toi={(0, 1): (0.1, 0.2)}),
        ]
    )
    assert joined.digest == detection().digest
    assert joined.faces_digest == detection().faces_digest
    assert joined.work["tests"] == 3
    assert joined.work["per frame"].tolist() == [0, 1, 2]
    assert joined.seconds["all"] == 1.0
    assert joined.reasons == {(2, 0): "why"}
    assert joined.toi == {(1, 1): (0.1, 0.2)}
    assert joined.section(1, 0)[0, 0, 0] == 1.0
    assert joined.section(0, 1).shape == (1, 2, 3)
    assert (
        repr(joined)
        == "Detection(test: 3 frames, 2 pairs, covers instants: 2 CLEAR, 2 CONTACT, 1 CONTAINED, 1 NO_POSE)"
    )


@pytest.mark.parametrize("more", [0, 1])
def test_notebook_table_counts_omitted_pairs(more):
    """Each pair touches in all 3 frames; 20 rows below the head are listed at most."""
    pairs = np.zeros((20 + more, 2), dtype=np.int64)
    page = detection(pairs=pairs, verdict=np.ones((3, len(pairs)), dtype=np.uint8))._repr_html_()
    assert page.count("<td>3</td>") == 20 and page.count("<tr>") == 21 and ("and 1 more" in page) == (more == 1)


def test_no_blocks_cannot_be_joined():
    with pytest.raises(ValueError, match="no block to join"):
        join([])


def test_verdict_numbers_stored_in_files_never_change():
    assert {verdict.name: int(verdict) for verdict in Verdict} == {
        "CLEAR": 0,
        "CONTACT": 1,
        "CONTAINED": 2,
        "CANDIDATE": 3,
        "NOT_FOUND": 4,
        "UNRESOLVED": 5,
        "INVALID": 6,
        "NO_POSE": 7,
    }


def test_contact_and_undecided_verdicts_are_disjoint():
    """Verdicts 0 to 7: CONTACT, CONTAINED, CANDIDATE (1 to 3) count; UNRESOLVED, INVALID, NO_POSE (5 to 7) are open."""
    every = np.arange(8, dtype=np.uint8).reshape(2, 4)
    assert counts_as_contact(every).tolist() == [[False, True, True, True], [False, False, False, False]]
    assert is_undecided(every).tolist() == [[False, False, False, False], [False, True, True, True]]


rows = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=0, max_size=4).map(
    lambda pairs: np.array(sorted(set(pairs)), dtype=np.int32).reshape(-1, 2)
)
entries = st.dictionaries(st.tuples(st.integers(0, 7), st.integers(0, 3)), rows, max_size=12)


def face_sets_of(table):
    """Sets of faces by (frame, pair)."""
    frame, pair = [key[0] for key in table], [key[1] for key in table]
    return sets_of(frame, pair, list(table.values()))


@given(entries)
def test_every_face_set_is_returned_for_its_frame_and_pair(table):
    """There are 8 frames and 4 pairs; where nothing was set the faces are empty."""
    sets = face_sets_of(table)
    counts = sets.counts(8, 4)
    for frame in range(8):
        for pair in range(4):
            expected = table.get((frame, pair), np.zeros((0, 2)))
            assert sets.at(frame, pair).tolist() == expected.tolist()
            assert counts[frame, pair] == len(expected)


@given(entries, st.integers(0, 8))
def test_joined_face_sets_equal_sets_made_at_once(table, cut):
    """Sets of 8 frames and 4 pairs are cut before a random frame and joined again."""
    before = {key: value for key, value in table.items() if key[0] < cut}
    after = {(frame - cut, pair): value for (frame, pair), value in table.items() if frame >= cut}
    joined = FaceSets.join([(0, face_sets_of(before)), (cut, face_sets_of(after))])
    for frame in range(8):
        for pair in range(4):
            assert joined.at(frame, pair).tolist() == face_sets_of(table).at(frame, pair).tolist()


@given(entries, st.sets(st.integers(0, 7)))
def test_face_sets_of_selected_frames_equal_the_whole(table, chosen):
    """Sets of 8 frames and 4 pairs; a selected frame gets its number in the selection."""
    whole, frames = face_sets_of(table), np.array(sorted(chosen), dtype=np.int64)
    taken = whole.take(frames)
    for number, frame in enumerate(frames):
        for pair in range(4):
            assert taken.at(number, pair).tolist() == whole.at(frame, pair).tolist()


def test_frames_with_equal_face_sets_store_a_single_set():
    """1,000 frames share a set of two face pairs."""
    item = np.array([[1, 2], [3, 4]])
    sets = FaceSets.from_shared(np.arange(1000), np.zeros(1000, dtype=int), np.zeros(1000, dtype=int), [item])
    assert len(sets.faces) == 2
    assert sets.at(999, 0).tolist() == item.tolist()


def test_entries_without_faces_are_omitted():
    """Frame 0 has an empty set of faces, frame 1 one pair: only frame 1 is kept."""
    sets = sets_of([0, 1], [0, 0], [np.zeros((0, 2)), np.array([[5, 6]])])
    assert sets.frame.tolist() == [1]
