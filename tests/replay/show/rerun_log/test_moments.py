"""Lists of moments in the picture, and which moment is nearest to a frame."""

from math import nan
from types import SimpleNamespace

import pytest

from replay.auditing.fault import Fault, FaultKind
from replay.auditing.outcome import Episode
from replay.show.rerun_log.moments import leading_moment, log_moment_lists, nearest_moments


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
