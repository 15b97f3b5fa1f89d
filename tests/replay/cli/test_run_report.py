"""The last words of a run: exit code 3 where poses or frames were lost, and a sentence for each repair."""

from types import SimpleNamespace

import pytest
from msgspec import structs
from support.report_states import EMPTY, document_with

from replay.cli.console import EXIT_DATA_LOSS, EXIT_OK, People
from replay.cli.run_report import close_run, repair_sentences
from replay.document.session import DroppedFrames, FlaggedPoses


def flagged(kind, body="rod", samples=3, dropped=3):
    """Poses in doubt, of which so many were dropped."""
    return FlaggedPoses(
        kind=kind, body=body, start_ns=0, end_ns=1, start=0.0, end=0.1, samples=samples, action="dropped",
        dropped=dropped, held=0, interpolated=0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("frames", "poses", "code"),
    [
        (DroppedFrames(0, 0), (), EXIT_OK),
        (DroppedFrames(1, 0), (), EXIT_DATA_LOSS),
        (DroppedFrames(0, 2), (), EXIT_DATA_LOSS),
        (DroppedFrames(0, 0), (flagged("not-finite"),), EXIT_DATA_LOSS),
        (DroppedFrames(0, 0), (flagged("not-finite", dropped=0),), EXIT_OK),
        (DroppedFrames(0, 0), (flagged("tracking-lost"),), EXIT_OK),
    ],
)
def test_lost_frames_or_damaged_poses_end_in_code_3(frames, poses, code):
    """``frames``: left out, of two kinds; ``poses``: flagged in the recording.

    Poses that are no numbers are damaged, if they were dropped; a tracker that lost a body and says so damaged nothing.
    """
    document = document_with(flagged=poses, session=structs.replace(EMPTY.session, dropped_frames=frames))
    assert close_run(SimpleNamespace(document=document), People()) == code


def test_repairs_are_added_by_kind_body_and_action():
    """Two teleports of a rod, 3 and 4 samples, are one line; frozen poses name no body; a gap is no repair."""
    poses = [
        flagged("teleport", samples=3),
        flagged("teleport", samples=4),
        flagged("frozen", body="", samples=3),
        flagged("gap"),
    ]
    assert repair_sentences(poses) == ["teleport of rod: 7 samples, dropped", "frozen: 3 samples, dropped"]
