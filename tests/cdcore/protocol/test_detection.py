"""A detection is checked and frozen; verdicts count as contact, as none, or are left out; face sets come back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdcore import Detection, FaceSets, Verdict, join
from cdcore.errors import NotRecordedError
from cdcore.protocol import counts_as_contact, is_undecided

FACE_PAIRS = np.array([[1, 7], [2, 3]])
"""Numbers of faces of the first and of the second body of a pair that meet."""


def sets_of(frame, pair, sets):
    """Sets of face pairs, one for each frame and pair."""
    return FaceSets.from_shared(*np.array([frame, pair, range(len(sets))], dtype=np.int64), sets)


def detection(**changes):
    """A detection of cup and rod, and rod and table, in three frames, but for ``changes``.

    Faces meet in frame 0 of pair 1, FACE_PAIRS[:1], and in frame 1 of pair 0, FACE_PAIRS.
    """
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
    """The same detection, bodies in another order, and table and rod, rod and cup as pairs."""
    face_pairs_swapped = np.array([[3, 2], [7, 1]])
    return detection(
        names=("table", "cup", "rod"),
        pairs=np.array([[0, 2], [2, 1]]),
        verdict=detection().verdict[:, ::-1].copy(),
        face_sets=sets_of([0, 1], [0, 1], [np.array([[7, 1]]), face_pairs_swapped]),
    )


def test_digests_ignore_the_order_of_bodies_and_pairs():
    """The other detection has its bodies in another order, and the bodies of each pair swapped."""
    assert detection().digest == same_in_another_order().digest
    assert detection().faces_digest == same_in_another_order().faces_digest


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"verdict": np.array([[0, 1], [1, 7], [1, 0]], dtype=np.uint8)}, id="a verdict"),
        pytest.param({"times": np.array([0.0, 0.5, 1.0000000000000002])}, id="a stamp by one rounding"),
        pytest.param({"names": ("cup", "rod", "desk")}, id="a name"),
        pytest.param({"covers": "intervals"}, id="what rows speak of"),
    ],
)
def test_a_digest_changes_with_any_verdict_stamp_or_name(change):
    """Verdicts are [[0, 1], [1, 7], [2, 0]] at 0, 0.5 and 1 s, of cup, rod and table, and rows speak of instants."""
    assert detection(**change).digest != detection().digest


def test_faces_digest_changes_with_a_single_face():
    """The other detection has face 4 where this one has face 3, in one pair of faces; verdicts are the same."""
    other = detection(face_sets=sets_of([0, 1], [1, 0], [FACE_PAIRS[:1], np.array([[1, 7], [2, 4]])]))
    assert other.faces_digest != detection().faces_digest
    assert other.digest == detection().digest


def test_faces_never_requested_raise_an_error():
    """A detection without lists of faces: the error says how to get them."""
    with pytest.raises(NotRecordedError, match=r"'test' holds no face pairs; call detect\(motion, faces=True\)"):
        _ = detection(face_sets=None).face_counts


def test_segments_of_a_detection_without_them_raise_an_error():
    """A detection has faces in frame 1 of pair 0, but nothing that computes segments."""
    with pytest.raises(NotRecordedError, match="no intersection segments"):
        detection().section(frame=1, pair=0)


def test_faces_are_indexed_by_frame_and_pair():
    """There are three frames and two pairs: frame 0 has a pair of faces in pair 1, and frame 1 two in pair 0.

    Negative numbers count from the end.
    """
    assert detection().faces(frame=1, pair=0).tolist() == FACE_PAIRS.tolist()
    assert detection().faces(frame=-2, pair=-2).tolist() == FACE_PAIRS.tolist()
    assert detection().faces(frame=2, pair=0).shape == (0, 2)
    assert detection().face_counts.tolist() == [[0, 1], [2, 0], [0, 0]]
    with pytest.raises(IndexError, match="there are 3 frames and 2 pairs"):
        detection().faces(frame=3, pair=0)


def test_detection_of_selected_frames_equals_the_whole_there():
    """Frames 1 and 2 of three are taken, so that frame k of the selection is frame k + 1 of the whole.

    Verdicts, faces, reasons and times of impact (``toi``) are by frame and pair.
    """
    whole = detection(reasons={(1, 1): "lost", (2, 0): "late"}, toi={(2, 1): (0.5, 1.0)})
    selection = whole.take(np.array([1, 2]))
    assert np.array_equal(selection.times, whole.times[1:])
    assert np.array_equal(selection.verdict, whole.verdict[1:])
    assert selection.reasons == {(0, 1): "lost", (1, 0): "late"}
    assert selection.toi == {(1, 1): (0.5, 1.0)}
    assert np.array_equal(selection.face_counts, whole.face_counts[1:])
    assert selection.faces(frame=0, pair=0).tolist() == FACE_PAIRS.tolist()


def test_detection_of_no_frames_has_no_faces():
    """An empty selection of three frames and two pairs."""
    assert detection().take(np.array([], dtype=np.int64)).face_counts.shape == (0, 2)


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
    """A block of frame 0 and one of frames 1 and 2, whose frame numbers shift by 1 in reasons and times of impact.

    Counters of work and seconds are added, what is counted by frame is appended. Segments of a contact have the frame's
    number as their coordinates here.
    """
    first = detection_of_frames(start=0, stop=1)
    second = detection_of_frames(start=1, stop=3, reasons={(1, 0): "why"}, toi={(0, 1): (0.1, 0.2)})
    joined = join([first, second])
    assert joined.digest == detection().digest
    assert joined.faces_digest == detection().faces_digest
    assert joined.work["tests"] == 1 + 2
    assert joined.work["per frame"].tolist() == [0, 1, 2]
    assert joined.seconds["all"] == 0.5 + 0.5
    assert joined.reasons == {(2, 0): "why"}
    assert joined.toi == {(1, 1): (0.1, 0.2)}
    assert joined.section(frame=1, pair=0).tolist() == np.full((2, 2, 3), 1.0).tolist()
    assert joined.section(frame=0, pair=1).tolist() == np.full((1, 2, 3), 0.0).tolist()


def test_detection_prints_its_size_and_counts_of_verdicts():
    """Three frames of two pairs with the verdicts [[0, 1], [1, 7], [2, 0]], joined of two blocks."""
    joined = join([detection_of_frames(start=0, stop=1), detection_of_frames(start=1, stop=3)])
    expected = "Detection(test: 3 frames, 2 pairs, covers instants: 2 CLEAR, 2 CONTACT, 1 CONTAINED, 1 NO_POSE)"
    assert repr(joined) == expected


@pytest.mark.parametrize(("count", "says_1_more"), [(20, False), (21, True)], ids="{} pairs".format)
def test_notebook_table_counts_omitted_pairs(count, says_1_more):
    """Each pair touches in all 3 frames; the table has a head and at most 20 rows, one for a pair.

    Of 21 pairs one is omitted, which the page says: "and 1 more".
    """
    pairs = np.zeros((count, 2), dtype=np.int64)
    page = detection(pairs=pairs, verdict=np.ones((3, count), dtype=np.uint8))._repr_html_()
    assert page.count("<tr>") == 1 + 20
    assert page.count("<td>3</td>") == 20
    assert ("and 1 more" in page) == says_1_more


def test_no_blocks_cannot_be_joined():
    """Nothing would say which bodies and pairs the detection has."""
    with pytest.raises(ValueError, match="no block to join"):
        join([])


def test_verdict_numbers_stored_in_files_never_change():
    """Files of runs have these numbers: with others an old file would be read wrongly."""
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
    """In an audit CONTACT, CONTAINED and CANDIDATE count as contact; UNRESOLVED, INVALID and NO_POSE are undecided."""
    numbers = np.arange(8, dtype=np.uint8)
    counted = [Verdict(number).name for number in numbers[counts_as_contact(numbers)]]
    undecided = [Verdict(number).name for number in numbers[is_undecided(numbers)]]
    assert counted == ["CONTACT", "CONTAINED", "CANDIDATE"]
    assert undecided == ["UNRESOLVED", "INVALID", "NO_POSE"]


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
    """``table``: random face pairs (k, 2) for some of 8 frames and 4 pairs; elsewhere the faces are empty."""
    sets = face_sets_of(table)
    counts = sets.counts(frames=8, pairs=4)
    for frame in range(8):
        for pair in range(4):
            expected = table.get((frame, pair), np.zeros((0, 2)))
            assert sets.at(frame, pair).tolist() == expected.tolist(), (frame, pair)
            assert counts[frame, pair] == len(expected), (frame, pair)


@given(entries, st.integers(0, 8))
def test_joined_face_sets_equal_sets_made_at_once(table, cut):
    """Random face pairs for some of 8 frames and 4 pairs; they are cut before frame ``cut`` and joined again."""
    before = {key: value for key, value in table.items() if key[0] < cut}
    after = {(frame - cut, pair): value for (frame, pair), value in table.items() if frame >= cut}
    joined = FaceSets.join([(0, face_sets_of(before)), (cut, face_sets_of(after))])
    for frame in range(8):
        for pair in range(4):
            assert joined.at(frame, pair).tolist() == face_sets_of(table).at(frame, pair).tolist(), (frame, pair)


@given(entries, st.sets(st.integers(0, 7)))
def test_face_sets_of_selected_frames_equal_the_whole(table, selected):
    """Random face pairs for some of 8 frames and 4 pairs; a selected frame gets its number in the selection."""
    whole, frames = face_sets_of(table), np.array(sorted(selected), dtype=np.int64)
    selection = whole.take(frames)
    for number, frame in enumerate(frames):
        for pair in range(4):
            assert selection.at(number, pair).tolist() == whole.at(frame, pair).tolist(), (number, frame, pair)


def test_frames_with_equal_face_sets_store_a_single_set():
    """1,000 frames of pair 0 share a set of two face pairs, number 0."""
    faces, zeros = np.array([[1, 2], [3, 4]]), np.zeros(1000, dtype=int)
    sets = FaceSets.from_shared(np.arange(1000), zeros, zeros, [faces])
    assert len(sets.faces) == 2
    assert sets.at(frame=999, pair=0).tolist() == faces.tolist()


def test_entries_without_faces_are_omitted():
    """Frame 0 of pair 0 has an empty set of faces, frame 1 one pair: only frame 1 is stored."""
    sets = sets_of([0, 1], [0, 0], [np.zeros((0, 2)), np.array([[5, 6]])])
    assert sets.frame.tolist() == [1]
