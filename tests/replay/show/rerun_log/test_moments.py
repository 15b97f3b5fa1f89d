"""Lists of moments in the picture, and which moment is nearest to a frame."""

from math import nan
from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Verdict
from replay.auditing.fault import Fault, FaultKind
from replay.auditing.outcome import Episode
from replay.errors import RunFolderError
from replay.show.rerun_log import moments as moments_module
from replay.show.rerun_log.moments import (
    bookmarks,
    key_moments,
    leading_moment,
    log_moment_lists,
    nearest_moments,
    read_bookmarks,
)


@pytest.mark.parametrize(
    ("kind", "metres", "depth", "size"),
    [
        (FaultKind.NEVER_REPORTED, 0.002, 0.004, "4 mm deep"),
        (FaultKind.NEVER_REPORTED, 0.002, nan, "2 mm curve"),
        (FaultKind.NEVER_REPORTED, nan, nan, ""),
        (FaultKind.NO_CONTACT, 0.002, nan, "2 mm apart"),
        (FaultKind.NO_CONTACT, 0.002, 0.004, "2 mm apart"),
        (FaultKind.NO_CONTACT, 0.0, nan, ""),
    ],
)
def test_moment_list_ends_in_depth_curve_or_gap(kind, metres, depth, size):
    """``metres``: length of a miss's curve, or the gap of a false contact; 0 and unknown are not printed."""
    fault = Fault(
        1, "hull", 0, ("cup", "rod"), kind, first=3, last=4, start=0.03, end=0.05, frame=3, metres=metres, depth=depth
    )
    lists = {}
    writer = SimpleNamespace(
        session_ns=lambda time: 10_000_000 * time[0], log_lines=lambda path, times, lines: lists.update({path: lines})
    )
    result = SimpleNamespace(assembly=SimpleNamespace(pair_name=lambda pair: "cup-rod"))
    log_moment_lists(writer, result, {(3, 0): fault})
    (((line, _, _),),) = lists.values()
    assert line.partition("cup-rod")[2].strip() == size and line.strip().startswith("0.03")


def test_nearest_moment_changes_at_half_time_or_between_frames():
    """Moments in frames 2, 6 and 9, and one 5 ns after frame 9."""
    times = [(2, 0), (6, 0), (9, 0), (9, 5)]
    assert nearest_moments(times) == [(0, 0, (2, 0)), (4, 0, (6, 0)), (8, 0, (9, 0)), (9, 5, (9, 5))]
    assert nearest_moments([]) == []


def result_with_answer(moment):
    """A run whose first answer is about ``hull`` at this moment; ``None``: nothing is wrong."""
    return SimpleNamespace(answers=[SimpleNamespace(label="hull", moment=moment)])


def test_picture_opens_at_the_fault_of_the_answer():
    """Two detectors have a miss 2; where the answer's fault is not drawn, the first moment leads."""
    faults = [("mesh", 2, 3), ("hull", 1, 5), ("hull", 2, 7)]
    moments = {
        (frame, 0): Fault(number, label, 0, ("cup", "rod"), FaultKind.NEVER_REPORTED, frame, frame, 0.0, 0.1, frame)
        for label, number, frame in faults
    }
    leading = [
        leading_moment(result_with_answer(SimpleNamespace(kind="miss", number=number)), moments) for number in (1, 2, 3)
    ]
    assert leading == [(5, 0), (7, 0), (3, 0)]


def test_picture_without_fault_opens_at_the_longest_contact():
    """Contacts of frames 1 to 2, 4 to 9 and 20 to 21."""
    moments = {(first, 0): Episode(0, first, last, 0.0, 0.1) for first, last in ((1, 2), (4, 9), (20, 21))}
    assert leading_moment(result_with_answer(None), moments) == (4, 0)


def fault_in(frame, number, metres, kind=FaultKind.NEVER_REPORTED, label="hull"):
    """A fault of pair 0 whose moment is this frame."""
    return Fault(number, label, 0, ("cup", "rod"), kind, frame, frame, 0.0, 0.1, frame, metres=metres)


def result_of(misses, false, contacts=()):
    """A run of three pairs in ten frames, the last two of one group; in frame 6 alone the last is in contact."""
    verdict = np.full((10, 3), Verdict.CONTACT)
    verdict[6, 1] = Verdict.CLEAR
    assembly = SimpleNamespace(contact_columns=np.array([0, 1, 1]), columns_of_contact=lambda pair: [1, 2])
    return SimpleNamespace(
        misses={"hull": misses},
        false={"hull": false},
        assembly=assembly,
        oracle="exact",
        comparisons={"hull": None},
        episodes={"exact": contacts, "hull": ()},
        detections={"exact": SimpleNamespace(verdict=verdict)},
    )


def test_faults_of_a_frame_follow_each_other_by_a_nanosecond():
    """In frame 5 the false contact comes first, then misses, the longest curve last; frame 7 begins anew."""
    small, large, later = fault_in(5, 1, 0.001), fault_in(5, 2, 0.002), fault_in(7, 3, 0.001)
    false = fault_in(5, 1, 0.003, FaultKind.NO_CONTACT)
    moments = key_moments(result_of((large, small, later), (false,)))
    assert [*moments.items()] == [((5, 0), false), ((5, 1), small), ((5, 2), large), ((7, 0), later)]


def test_longest_contact_of_a_faultless_pair_is_a_moment():
    """Contacts of frames 0 to 1 and 4 to 8; in its middle, frame 6, the second pair of the group touches."""
    contacts = [Episode(1, 0, 1, 0.0, 0.1), Episode(1, 4, 8, 0.4, 0.9)]
    moments = key_moments(result_of((fault_in(2, 1, 0.001),), (), contacts))
    assert [(time, moment.pair, moment.first) for time, moment in moments.items()] == [((2, 0), 0, 2), ((6, 0), 2, 4)]


def test_line_of_a_contact_counts_its_frames():
    """The contact is in frames 3 to 7; its moment is at 0 s of the session."""
    lists = {}
    writer = SimpleNamespace(
        session_ns=lambda time: 0, log_lines=lambda path, times, lines: lists.update({path: lines})
    )
    result = SimpleNamespace(assembly=SimpleNamespace(pair_name=lambda pair: "cup-rod"))
    log_moment_lists(writer, result, {(5, 0): Episode(0, 3, 7, 0.0, 0.1)})
    (((line, _, _),),) = lists.values()
    assert line.split() == ["0.000", "s", "contact", "5", "frames", "cup-rod"]


def test_bookmarks_are_sorted_by_detector_and_the_first_leads():
    """The answer is about miss 2 of ``hull``, which is the first of the detectors."""
    faults = {(3, 0): fault_in(3, 1, 0.1, label="mesh"), (5, 0): fault_in(5, 2, 0.1), (8, 0): fault_in(8, 3, 0.1)}
    moments = {**faults, (9, 0): Episode(1, 9, 9, 0.0, 0.1)}
    result = result_with_answer(SimpleNamespace(kind="miss", number=2))
    result.comparisons = {"hull": None, "mesh": None}
    writer = SimpleNamespace(session_ns=lambda time: 10 * time[0])
    rows = [(row.label, row.number, row.session_ns, row.leads) for row in bookmarks(writer, result, moments)]
    assert rows == [("hull", 2, 50, True), ("hull", 3, 80, False), ("mesh", 1, 30, False), ("", 0, 90, False)]


@pytest.mark.parametrize(
    ("has_rows", "texts", "refused"),
    [(False, [], False), (True, ["[]"], False), (True, [], True), (False, ["[]"], False)],
)
def test_picture_with_rows_but_no_positions_is_of_another_version(has_rows, texts, refused, monkeypatch, tmp_path):
    """A recording that compares nothing has no rows either, and no positions of the cursor."""
    monkeypatch.setattr(moments_module, "require_complete_file", lambda path: None)
    monkeypatch.setattr(moments_module, "read_texts", lambda path, entity, component: (has_rows, texts))
    if refused:
        with pytest.raises(RunFolderError, match="earlier version"):
            read_bookmarks(tmp_path / "run.rrd")
    else:
        assert read_bookmarks(tmp_path / "run.rrd") == []
