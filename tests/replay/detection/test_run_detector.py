from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.detection import run_detector as detecting
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector, run_detector
from replay.prepare.assemble import assemble


def assembly_of_cubes(frames=50):
    """Two cubes, the second of which passes through the first in the middle of the motion."""
    return assemble(unit_cubes_on_x({"a": [0] * frames, "b": np.abs(np.linspace(-3, 3, frames))}))


def run_over_cubes(detector, *, seed=0, faces=False, advance=lambda frames: None, live=False):
    """The run of a detector over 50 frames of two cubes; ``advance`` gets the frames that are done."""
    return run_detector(
        parse_detector(detector), assembly_of_cubes(), seed=seed, faces=faces, advance=advance, live=live
    )


def test_detection_reports_its_settings_and_times():
    """A detector that samples at 10 Hz, over 50 frames: it has an answer for each, and reports all as done.

    Its settings are that of the request and others, as ``containment``; each stage took time. Faces that meet were not
    requested.
    """
    frames_done = []
    run = run_over_cubes("discrete[rate_hz=10]", advance=frames_done.append)
    assert run.settings["rate_hz"] == 10 and "containment" in run.settings
    assert sum(frames_done) == 50 == len(run.detection.times)
    assert run.prepare > 0 and run.warm > 0 and run.detect > 0
    assert run.detection.face_sets is None


@pytest.mark.parametrize(("live", "fraction"), [(True, 0.0), (False, None)], ids=["sample by sample", "at once"])
def test_processor_fraction_covers_the_samples_alone(monkeypatch, live, fraction):
    """The process waits all the time: its clock of processor time stands still.

    Only a ``live`` run is timed sample by sample, and has the fraction of that time in which the processor worked.
    """
    monkeypatch.setattr(detecting, "process_time", lambda: 100.0)
    assert run_over_cubes("sphere", live=live).processor_fraction == fraction


def test_processor_fraction_divides_worked_by_elapsed_seconds(monkeypatch):
    """The samples begin at 14 s and end at 16 s on the clock, in which the processor works from 5 to 6 s: a half.

    Before them the clock is read at 10 and 12 s, around the making of the detector, and at 18 s when all is done.
    """
    worked, clock = iter([5.0, 6.0]), iter([10.0, 12.0, 14.0, 16.0, 18.0])
    monkeypatch.setattr(detecting, "process_time", lambda: next(worked))
    monkeypatch.setattr(detecting, "perf_counter", lambda: next(clock))
    run = run_over_cubes("sphere", live=True)
    assert (run.processor_seconds, run.processor_fraction) == (6.0 - 5.0, (6.0 - 5.0) / (16.0 - 14.0))


@pytest.mark.parametrize(
    ("processor_s", "counted_s"),
    [(0.1, 0.1), (0.5, 0.4), (None, 0.4), (0.0, 0.4)],
    ids=["less than the clock", "more, of threads beside", "not known", "clock too coarse"],
)
def test_mean_leaves_out_the_time_of_other_programs(processor_s, counted_s):
    """Detecting took 0.4 s, in which the processor worked for this process for ``processor_s``.

    The mean a frame is of the less of both, as in the rest of the time other programs had the processor; of a clock of
    processor time that stands at 0, or is not there, it is of the 0.4 s.
    """
    run = replace(run_over_cubes("sphere"), detect=0.4, processor_seconds=processor_s)
    assert run.seconds_per_frame == pytest.approx(counted_s / len(run.detection.times))


@pytest.mark.parametrize("detector", ["hybrid", "discrete[rate_hz=30]"])
def test_detector_over_a_long_motion_in_blocks_equals_whole(monkeypatch, detector):
    """50 frames in calls of at most 7 are seven blocks of 7 and one of 1: verdicts and faces that meet are the same."""
    whole = run_over_cubes(detector, faces=True)
    monkeypatch.setattr(detecting, "MOST_FRAMES_PER_CALL", 7)
    frames_done = []
    in_blocks = run_over_cubes(detector, faces=True, advance=frames_done.append)
    assert frames_done == [7] * 7 + [1]
    assert in_blocks.detection.digest == whole.detection.digest
    assert whole.detection.face_sets is not None
    assert in_blocks.detection.faces_digest == whole.detection.faces_digest


def test_run_lists_faces_only_of_detectors_that_can():
    """Faces that meet are requested of both: ``hybrid`` tests meshes and lists them, ``sphere`` knows none."""
    assert run_over_cubes("hybrid", faces=True).faces
    assert not run_over_cubes("sphere", faces=True).faces


@pytest.mark.parametrize("count", [1, 2, 100, 1000, 54_000])
def test_warm_up_frames_are_few_and_span_the_motion(count):
    """A detector warms up on two samples of at most WARM_UP_FRAMES of ``count`` frames: successive ones, and a spread.

    First and last are always among them, and each frame is there once.
    """
    frames = detecting.warm_frames(count)
    assert frames[0] == 0 and frames[-1] == count - 1
    assert len(frames) <= 2 * detecting.WARM_UP_FRAMES
    assert (np.diff(frames) > 0).all()


@pytest.mark.parametrize(("detector", "seed"), [("qaco", 7), ("qaco[seed=3]", 3)])
def test_run_seed_reaches_random_detectors_without_their_own(detector, seed):
    """qaco searches at random, from a seed: that of the run, 7, unless its own settings have one."""
    assert make_detector(parse_detector(detector), assembly_of_cubes(), seed=7).settings.seed == seed


def test_search_is_traced_again_except_for_hours_of_motion(monkeypatch):
    """A search runs again over a motion of 50 frames to trace its evaluations, which stay in memory.

    Where the limit is a frame less there is no second run.
    """
    assembly = assembly_of_cubes(frames=50)
    detector = make_detector(parse_detector("qaco"), assembly, seed=0)
    assert detecting.watched_again(detector, assembly.motion) is not None
    monkeypatch.setattr(detecting, "MOST_FRAMES_IN_MEMORY", 50 - 1)
    assert detecting.watched_again(detector, assembly.motion) is None
