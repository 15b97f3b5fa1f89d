"""The pipeline read back: misses are where the surfaces meet, and both volumes are in sight."""

import numpy as np
import pytest

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.poses import rotation_from_quaternion
from replay.show.palette import MISSED, SERIES_COLOURS
from replay.show.rerun_log.pipeline_view import LOST, TRUE_CONTACT, search_runs
from replay.show.rerun_log.recording_file import pack_colours
from replay.words import length

LABEL = "paper"
ROOT = f"pipeline/{LABEL}"


@pytest.fixture(scope="module")
def traced_run(searching):
    """The only detector of the run whose search is traced."""
    (item,) = search_runs(searching)
    return item


@pytest.fixture(scope="module")
def drawn_recording(searching, drawn):
    """The Rerun recording of a run of the paper's search, read back."""
    return drawn(searching)


def test_missed_contact_is_red_with_the_distance_of_the_search(searching, traced_run, drawn_recording):
    """The last two dots are where the search stopped, and the place of contact that is nearest to it."""
    lost = [moment for moment in traced_run.searches if moment.kind == LOST]
    assert lost
    for moment in lost:
        *_, stop, meeting_point = drawn_recording.at(f"{ROOT}/search/dots", "Points3D:positions", moment.frame)
        assert (
            drawn_recording.at(f"{ROOT}/search/dots", "Points3D:colors", moment.frame)[-1] == pack_colours([MISSED])[0]
        )
        section = searching.detections["hybrid"].section(moment.frame, moment.pair).mean(axis=1)
        assert np.linalg.norm(section - meeting_point, axis=1).min() < 1e-6
        text = drawn_recording.at(f"{ROOT}/search/words", "Points3D:labels", moment.frame)[-1]
        assert text.startswith("missed") and length(float(np.linalg.norm(np.subtract(stop, meeting_point)))) in text
    result = next(moment for moment in traced_run.searches if moment.kind == TRUE_CONTACT)
    assert (
        drawn_recording.at(f"{ROOT}/search/dots", "Points3D:colors", result.frame)[-1]
        == pack_colours([SERIES_COLOURS[2]])[0]
    )


def test_view_of_bounding_volumes_shows_both_spheres_entirely(searching, traced_run, drawn_recording):
    """Each ball lies within the four side planes of the eye's view."""
    # The view is 595 pixels wide and 640 high, and its eye opens 0.9 radians upward.
    half = np.arctan(np.tan(0.45) * 595 / 640)
    assert traced_run.searches
    for moment in traced_run.searches:
        (eye,) = drawn_recording.at(f"{ROOT}/near/eye", "Transform3D:translation", moment.frame)
        (rotation,) = drawn_recording.at(f"{ROOT}/near/eye", "Transform3D:quaternion", moment.frame)
        axes = rotation_from_quaternion(np.array(rotation))
        for body in searching.assembly.pairs[moment.pair].tolist():
            ball = sphere_best(searching.assembly.bodies[body].mesh)
            if ball.radius < 0.5:
                rotated = searching.assembly.motion.rotations[moment.frame, body] @ ball.centre
                middle = (rotated + searching.assembly.motion.translations[moment.frame, body] - eye) @ axes
                assert -middle[2] * np.sin(half) - abs(middle[0]) * np.cos(half) >= ball.radius
