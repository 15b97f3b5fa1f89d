"""The pipeline read back: misses are where the surfaces meet, and both volumes are in sight."""

import numpy as np
import pytest

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.poses import rotation_from_quaternion
from replay.show.palette import MISSED
from replay.show.rerun_log.pipeline_view import CONFIRMED, LOST, STAGE_COLOURS, TRUE_CONTACT, search_runs
from replay.show.rerun_log.recording_file import pack_colours
from replay.words import length

LABEL = "paper"
ROOT = f"pipeline/{LABEL}"


@pytest.fixture(scope="module")
def traced_run(searching):
    """The searches of the only detector of the run, the paper's (``hybrid-qaco``), as the picture draws them."""
    (run,) = search_runs(searching)
    return run


@pytest.fixture(scope="module")
def drawn_recording(searching, drawn):
    """The Rerun recording of a run of the paper's search, read back."""
    return drawn(searching)


def last_values(recorded, component, frame):
    """Values of a component of the dots of a search that a viewer shows at a frame."""
    return recorded.at(f"{ROOT}/search/dots", component, frame)


def test_missed_contact_is_red_with_the_distance_of_the_search(searching, traced_run, drawn_recording):
    """In frames in which the search misses a contact, its last two dots are where it stopped, and the nearest contact.

    That is a middle of a segment of the curve where the surfaces meet, by the reference; it is red, and a text says
    how far away the search stopped.
    """
    missed_searches = [search for search in traced_run.searches if search.kind == LOST]
    assert missed_searches
    for search in missed_searches:
        *_, stop, meeting_point = last_values(drawn_recording, "Points3D:positions", search.frame)
        *_, colour = last_values(drawn_recording, "Points3D:colors", search.frame)
        *_, text = drawn_recording.at(f"{ROOT}/search/words", "Points3D:labels", search.frame)
        curve_points = searching.detections["hybrid"].section(search.frame, search.pair).mean(axis=1)
        assert np.linalg.norm(curve_points - meeting_point, axis=1).min() < 1e-6
        assert [colour] == pack_colours([MISSED]).tolist()
        assert text.startswith("missed")
        assert length(float(np.linalg.norm(np.subtract(stop, meeting_point)))) in text


def test_contact_that_the_search_meets_has_its_own_colour(traced_run, drawn_recording):
    """In a frame in which the search meets a contact its last dot is green, the colour of confirmed pairs."""
    search = next(search for search in traced_run.searches if search.kind == TRUE_CONTACT)
    *_, colour = last_values(drawn_recording, "Points3D:colors", search.frame)
    assert [colour] == pack_colours([STAGE_COLOURS[CONFIRMED]]).tolist()


def test_view_of_bounding_volumes_shows_both_spheres_entirely(searching, traced_run, drawn_recording):
    """In a frame with a search the view shows the bounding spheres of both bodies: each within its two side planes.

    The view is 595 pixels wide and 640 high, and its eye opens 0.9 radians upwards. Spheres of 0.5 m and more, of the
    bench, are too large for that.
    """
    half_opening = np.arctan(np.tan(0.9 / 2) * 595 / 640)
    checked = 0
    for search in traced_run.searches:
        (eye,) = drawn_recording.at(f"{ROOT}/near/eye", "Transform3D:translation", search.frame)
        (quaternion,) = drawn_recording.at(f"{ROOT}/near/eye", "Transform3D:quaternion", search.frame)
        eye_axes = rotation_from_quaternion(np.array(quaternion))
        for body in searching.assembly.pairs[search.pair].tolist():
            sphere = sphere_best(searching.assembly.bodies[body].mesh)
            if sphere.radius >= 0.5:
                continue
            rotated = searching.assembly.motion.rotations[search.frame, body] @ sphere.centre
            centre = rotated + searching.assembly.motion.translations[search.frame, body]
            right, _up, back = (centre - eye) @ eye_axes
            distance_of_side_plane = -back * np.sin(half_opening) - abs(right) * np.cos(half_opening)
            assert distance_of_side_plane >= sphere.radius
            checked += 1
    assert checked > 0
