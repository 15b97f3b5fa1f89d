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


def test_moment_list_ends_in_depth_curve_or_gap():
    """``metres``: of a miss, length of the curve where surfaces meet; of a false contact, the gap. A miss has a depth.

    A line of the list begins with the second of the moment, frame 3 of 10 ms, and ends with pair and size.
    """
    rows = {
        "miss, depth known": (FaultKind.NEVER_REPORTED, 0.002, 0.004, "4 mm deep"),
        "miss, curve known": (FaultKind.NEVER_REPORTED, 0.002, nan, "2 mm curve"),
        "miss, nothing known": (FaultKind.NEVER_REPORTED, nan, nan, ""),
        "false contact": (FaultKind.NO_CONTACT, 0.002, nan, "2 mm apart"),
        "false contact, depth ignored": (FaultKind.NO_CONTACT, 0.002, 0.004, "2 mm apart"),
        "false contact without a gap": (FaultKind.NO_CONTACT, 0.0, nan, ""),
    }
    for row, (kind, metres, depth, size) in rows.items():
        fault = Fault(
            number=1, detector="hull", pair=0, bodies=("cup", "rod"), kind=kind, first=3, last=4, start=0.03, end=0.05,
            frame=3, metres=metres, depth=depth,
        )  # fmt: skip
        line = line_of_moment((3, 0), fault)
        assert line.strip().startswith("0.03"), row
        assert line.partition("cup-rod")[2].strip() == size, row


def line_of_moment(time, moment):
    """The only line in the lists of a run with this moment, of the pair cup-rod; a frame takes 10 ms."""
    lists = []
    writer = SimpleNamespace(
        session_ns=lambda frame_and_ns: 10_000_000 * frame_and_ns[0],
        log_lines=lambda path, times, lines: lists.append(lines),
    )
    result = SimpleNamespace(assembly=SimpleNamespace(pair_name=lambda pair: "cup-rod"))
    log_moment_lists(writer, result, {time: moment})
    (((line, _level, _colour),),) = lists
    return line


def test_nearest_moment_changes_at_half_time_or_between_frames():
    """Moments are (frame, nanoseconds after it): in frames 2, 6 and 9, and 5 ns after frame 9.

    A row says from which frame, and nanoseconds after it, on a moment is the nearest: from frame 4 on that of frame 6,
    from frame 8 on that of frame 9; moments of one frame follow each other.
    """
    moments = [(2, 0), (6, 0), (9, 0), (9, 5)]
    assert nearest_moments(moments) == [(0, 0, (2, 0)), (4, 0, (6, 0)), (8, 0, (9, 0)), (9, 5, (9, 5))]
    assert nearest_moments([]) == []


def result_with_answer(moment):
    """A run whose first answer is about ``hull`` at this moment; ``None``: nothing is wrong."""
    return SimpleNamespace(answers=[SimpleNamespace(label="hull", moment=moment)])


def test_picture_opens_at_the_fault_of_the_answer():
    """The answer of a run is about the miss ``number`` of the detector ``hull``.

    Moments are miss 2 of ``mesh`` in frame 3, and misses 1 and 2 of ``hull`` in frames 5 and 7.
    """
    rows = {
        "miss 1 of hull": (1, 5),
        "miss 2 of hull, not of mesh": (2, 7),
        "miss 3 is not drawn: the first moment": (3, 3),
    }
    faults = [
        fault_in(frame=3, number=2, label="mesh"),
        fault_in(frame=5, number=1, label="hull"),
        fault_in(frame=7, number=2, label="hull"),
    ]
    moments = {(fault.frame, 0): fault for fault in faults}
    for row, (number, frame) in rows.items():
        result = result_with_answer(SimpleNamespace(kind="miss", number=number))
        assert leading_moment(result, moments) == (frame, 0), row


def test_picture_without_fault_opens_at_the_longest_contact():
    """Nothing is wrong in a run.

    Its moments are contacts of frames 1 to 2, 4 to 9 and 20 to 21, at their first frame.
    """
    frames = [(1, 2), (4, 9), (20, 21)]
    moments = {(first, 0): contact_in(first, last) for first, last in frames}
    assert leading_moment(result_with_answer(None), moments) == (4, 0)


def fault_in(frame, number, metres=0.1, kind=FaultKind.NEVER_REPORTED, label="hull"):
    """A fault of pair 0, cup and rod, whose moment is this frame; ``metres``: length of its curve."""
    return Fault(
        number=number, detector=label, pair=0, bodies=("cup", "rod"), kind=kind, first=frame, last=frame, start=0.0,
        end=0.1, frame=frame, metres=metres,
    )  # fmt: skip


def contact_in(first, last, pair=0):
    """A contact of a pair from its first to its last frame; its seconds do not matter."""
    return Episode(pair=pair, first=first, last=last, start=0.0, end=0.1)


def result_of(misses, false_contacts=(), contacts=()):
    """A run of three pairs in ten frames, the last two of one group; in frame 6 alone the last is in contact."""
    verdict = np.full((10, 3), Verdict.CONTACT)
    verdict[6, 1] = Verdict.CLEAR
    assembly = SimpleNamespace(contact_columns=np.array([0, 1, 1]), columns_of_contact=lambda pair: [1, 2])
    return SimpleNamespace(
        misses={"hull": misses},
        false={"hull": false_contacts},
        assembly=assembly,
        oracle="exact",
        comparisons={"hull": None},
        episodes={"exact": contacts, "hull": ()},
        detections={"exact": SimpleNamespace(verdict=verdict)},
    )


def test_faults_of_a_frame_follow_each_other_by_a_nanosecond():
    """In frame 5: a false contact, and misses with curves of 1 and 2 mm; in frame 7 a miss.

    Moments are (frame, nanoseconds after it): the false contact first, then the misses, the longest curve last.
    """
    short, long = fault_in(frame=5, number=1, metres=0.001), fault_in(frame=5, number=2, metres=0.002)
    later = fault_in(frame=7, number=3, metres=0.001)
    false_contact = fault_in(frame=5, number=1, metres=0.003, kind=FaultKind.NO_CONTACT)
    moments = key_moments(result_of((short, long, later), (false_contact,)))
    assert [*moments.items()] == [((5, 0), false_contact), ((5, 1), short), ((5, 2), long), ((7, 0), later)]


def test_longest_contact_of_a_faultless_pair_is_a_moment():
    """Pair 0 has a miss, whose moment is frame 2. Pairs 1 and 2 are a group without faults: contacts 0 to 1 and 4 to 8.

    The moment of the longer one is its middle, frame 6, in which only pair 2 of the group is in contact.
    """
    contacts = [contact_in(0, 1, pair=1), contact_in(4, 8, pair=1)]
    moments = key_moments(result_of((fault_in(frame=2, number=1),), contacts=contacts))
    pair_and_first_frame = {time: (moment.pair, moment.first) for time, moment in moments.items()}
    assert pair_and_first_frame == {(2, 0): (0, 2), (6, 0): (2, 4)}


def test_line_of_a_contact_counts_its_frames():
    """A contact of the pair cup-rod in frames 3 to 7, five of them; its moment is frame 5, at 50 ms."""
    line = line_of_moment((5, 0), contact_in(3, 7))
    assert line.split() == ["0.050", "s", "contact", "5", "frames", "cup-rod"]


def test_bookmarks_are_sorted_by_detector_and_the_first_leads():
    """Moments in frames of 10 ns: miss 1 of ``mesh`` in frame 3, misses 2 and 3 of ``hull`` in 5 and 8, a contact in 9.

    Bookmarks of ``hull``, the first detector of the run, come first, those of no detector last. The answer of the run
    is about miss 2 of ``hull``, which leads.
    """
    moments = {
        (3, 0): fault_in(frame=3, number=1, label="mesh"),
        (5, 0): fault_in(frame=5, number=2),
        (8, 0): fault_in(frame=8, number=3),
        (9, 0): contact_in(9, 9, pair=1),
    }
    result = result_with_answer(SimpleNamespace(kind="miss", number=2))
    result.comparisons = {"hull": None, "mesh": None}
    writer = SimpleNamespace(session_ns=lambda frame_and_ns: 10 * frame_and_ns[0])
    rows = [(row.label, row.number, row.session_ns, row.leads) for row in bookmarks(writer, result, moments)]
    assert rows == [("hull", 2, 50, True), ("hull", 3, 80, False), ("mesh", 1, 30, False), ("", 0, 90, False)]


def read_bookmarks_of(monkeypatch, tmp_path, *, has_rows, texts):
    """Bookmarks of a recording with or without rows of moments, and with these texts of bookmarks."""
    monkeypatch.setattr(moments_module, "require_complete_file", lambda path: None)
    monkeypatch.setattr(moments_module, "read_texts", lambda path, entity, component: (has_rows, texts))
    return read_bookmarks(tmp_path / "run.rrd")


def test_picture_with_rows_but_no_bookmarks_is_of_another_version(monkeypatch, tmp_path):
    """Earlier versions wrote rows of moments, but not the text (JSON) with bookmarks, so there is none."""
    with pytest.raises(RunFolderError, match="earlier version"):
        read_bookmarks_of(monkeypatch, tmp_path, has_rows=True, texts=[])


def test_picture_without_moments_has_no_bookmarks(monkeypatch, tmp_path):
    """A run that compares nothing has no moments: its recording may lack rows of them and the text with bookmarks."""
    rows = {
        "neither rows nor a text": (False, []),
        "rows and an empty list": (True, ["[]"]),
        "an empty list": (False, ["[]"]),
    }
    for row, (has_rows, texts) in rows.items():
        assert read_bookmarks_of(monkeypatch, tmp_path, has_rows=has_rows, texts=texts) == [], row
