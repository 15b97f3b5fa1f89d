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


def test_detection_reports_its_settings_and_times():
    """The motion has 50 frames; ``containment`` is a setting that was not requested."""
    reported = []
    run = run_detector(
        parse_detector("discrete[rate_hz=10]"), assembly_of_cubes(), seed=0, faces=False, advance=reported.append
    )
    assert run.settings["rate_hz"] == 10 and "containment" in run.settings
    assert sum(reported) == 50 == len(run.detection.times)
    assert run.prepare > 0 and run.warm > 0 and run.detect > 0
    assert run.detection.face_sets is None


def test_processor_fraction_covers_the_samples_alone(monkeypatch):
    """The clock of processor time stands still; only a live run is timed sample by sample."""
    monkeypatch.setattr(detecting, "process_time", lambda: 100.0)  # a process that waits all the time
    requested = {"seed": 0, "faces": False, "advance": lambda done: None}
    assert run_detector(parse_detector("sphere"), assembly_of_cubes(), live=True, **requested).processor_fraction == 0.0
    assert run_detector(parse_detector("sphere"), assembly_of_cubes(), **requested).processor_fraction is None


def test_processor_fraction_divides_worked_by_elapsed_seconds(monkeypatch):
    """The samples begin at 14 s and end at 16 s on the clock, in which the processor works from 5 to 6 s."""
    worked, clock = iter([5.0, 6.0]), iter([10.0, 12.0, 14.0, 16.0, 18.0])
    monkeypatch.setattr(detecting, "process_time", lambda: next(worked))
    monkeypatch.setattr(detecting, "perf_counter", lambda: next(clock))
    run = run_detector(
        parse_detector("sphere"), assembly_of_cubes(), live=True, seed=0, faces=False, advance=lambda done: None
    )
    assert (run.processor_seconds, run.processor_fraction) == (1.0, 0.5)


def test_mean_leaves_out_the_time_of_other_programs():
    """Detecting took 0.4 s, of which the processor worked 0.1 s for this process: that counts where it is known.

    More processor time than 0.4 s, of threads beside, leaves 0.4 s.
    """
    run = run_detector(parse_detector("sphere"), assembly_of_cubes(), seed=0, faces=False, advance=lambda _: None)
    frames = len(run.detection.times)
    busy = replace(run, detect=0.4, processor_seconds=0.1)
    assert busy.seconds_per_frame == pytest.approx(0.1 / frames)
    for unknown in (None, 0.0):
        assert replace(busy, processor_seconds=unknown).seconds_per_frame == pytest.approx(0.4 / frames)
    # Work beside the samples counts for the process alone.
    assert replace(busy, processor_seconds=0.5).seconds_per_frame == pytest.approx(0.4 / frames)


@pytest.mark.parametrize("spec", ["hybrid", "discrete[rate_hz=30]"])
def test_detector_over_a_long_motion_in_blocks_equals_whole(monkeypatch, spec):
    """50 frames in calls of at most 7 are seven blocks of 7 and one of 1."""
    whole = run_detector(parse_detector(spec), assembly_of_cubes(), seed=0, faces=True, advance=lambda done: None)
    monkeypatch.setattr(detecting, "MOST_FRAMES_PER_CALL", 7)
    reported = []
    cut = run_detector(parse_detector(spec), assembly_of_cubes(), seed=0, faces=True, advance=reported.append)
    assert reported == [7] * 7 + [1]
    assert cut.detection.digest == whole.detection.digest
    if whole.detection.face_sets is not None:
        assert cut.detection.faces_digest == whole.detection.faces_digest


def test_warm_up_frames_are_few_and_span_the_motion():
    """``count``: frames of a motion; first and last are always among those that warm up."""
    for count in (1, 2, 100, 1000, 54_000):
        frames = detecting.warm_frames(count)
        assert frames[0] == 0 and frames[-1] == count - 1
        assert len(frames) <= 2 * detecting.WARM_UP_FRAMES and (np.diff(frames) > 0).all()


@pytest.mark.parametrize(("spec", "seed"), [("qaco", 7), ("qaco[seed=3]", 3)])
def test_run_seed_reaches_random_detectors_without_their_own(spec, seed):
    """The run's seed is 7; a seed among the settings comes before it."""
    assert make_detector(parse_detector(spec), assembly_of_cubes(), seed=7).settings.seed == seed


def test_search_is_traced_again_except_for_hours_of_motion(monkeypatch):
    """A trace of each evaluation of the search is kept in memory, for motions up to a limit of frames."""
    assembly = assembly_of_cubes(frames=50)
    detector = make_detector(parse_detector("qaco"), assembly, seed=0)
    assert detecting.watched_again(detector, assembly.motion) is not None
    monkeypatch.setattr(detecting, "MOST_FRAMES_IN_MEMORY", 50 - 1)
    assert detecting.watched_again(detector, assembly.motion) is None
