"""The guide's page of real recordings says what its command makes of those that lie beside the checkout."""

import re
import shlex

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.optional import needs_data
from support.processes import script

from replay.guide.pages import page


@pytest.fixture(scope="module")
def real_recordings():
    """The script as a module."""
    return script("real_recordings")


@pytest.fixture(scope="module")
def printed_rows(real_recordings):
    """Name of a recording -> the cells of its row on the page."""
    lines = [line.strip("| ").split(" | ") for line in page("results").splitlines() if line.startswith("|")]
    return {cells[0]: cells for cells in lines if len(cells) == len(real_recordings.HEAD)}


@needs_data
@pytest.mark.slow
def test_rows_of_available_recordings_are_reproduced(real_recordings, printed_rows):
    """The script makes the rows of the recordings that are there, five or more: all cells but times are as printed."""
    made_rows = list(real_recordings.rows(None))
    assert len(made_rows) >= 5
    for cells in made_rows:
        name, without_times = cells[0], cells[: -real_recordings.TIMES]
        assert without_times == printed_rows[name][: -real_recordings.TIMES]


def test_every_recording_has_a_row_in_order_of_the_script(real_recordings, printed_rows):
    """The page has a row for each of the script's recordings, eight or more."""
    names = [item.name for item in real_recordings.RECORDINGS]
    assert len(names) >= 8
    assert [name for name in printed_rows if name in names] == names


def test_every_recording_has_a_source_and_a_fetch_command(real_recordings, tmp_path):
    """The page names its repository; a command of the shell fetches its file at a commit of 40 hexadecimal digits."""
    commands = list(real_recordings.fetch_commands(tmp_path))
    assert all(shlex.split(command) for command in commands)
    for item in real_recordings.RECORDINGS:
        assert item.repository in page("results")
        assert re.fullmatch("[0-9a-f]{40}", item.commit)
        source = f"{item.commit}:{item.path}"
        assert any(source in command and command.endswith(item.file) for command in commands)


@pytest.mark.parametrize("yaw", [0.0, 35.0])
def test_two_posts_stand_beside_a_headset_in_any_direction(real_recordings, tmp_path, yaw):
    """A person stands still for 300 frames, looking ``yaw`` degrees aside, as a table of a class's recordings has it.

    The session has two posts, whose walls are 5 cm left and right of the headset; they are made, not recorded.
    """
    x, y, z, w = Rotation.from_euler("y", yaw, degrees=True).as_quat()
    pose = f"1.0,1.2,0.5,{x},{y},{z},{w}"
    lines = [f"09:30:{frame / 90:09.6f},{device},{pose}" for frame in range(300) for device in ("H", "T")]
    file, mapping = tmp_path / "subject.txt", tmp_path / "columns.toml"
    file.write_text("\n".join(["Time,Device,X,Y,Z,qX,qY,qZ,qW", *lines]), encoding="utf-8")
    mapping.write_text(real_recordings.CLASS_MAPPING, encoding="utf-8")
    session = real_recordings.participant_session(file, "P99", mapping)
    assert session.facts["pseudonym"] == "P99"
    assert set(session.tracks) == {"headset", "left post", "right post"}

    def vertices_in_first_frame(name):
        track = session.tracks[name]
        rotation = Rotation.from_quat(track.quaternions_xyzw[0]).as_matrix()
        return session.meshes[name].vertices @ rotation.T + track.positions[0]

    left, right, headset = map(vertices_in_first_frame, ("left post", "right post", "headset"))
    across = right.mean(axis=0) - left.mean(axis=0)
    across /= np.linalg.norm(across)
    # A post's wall is a plane: as far from the headset as its farthest corner on that side.
    right_gap = (right @ across).min() - (headset @ across).max()
    left_gap = (headset @ across).min() - (left @ across).max()
    assert (left_gap, right_gap) == pytest.approx((0.05, 0.05), abs=2e-3)


def test_section_of_the_page_is_the_template_filled_in(real_recordings):
    """The template's text stands on the page with something in place of each {field}; no field is left.

    The table of sources is the one that the script makes.
    """
    text = page("results").partition(real_recordings.BEGIN)[2].partition(real_recordings.END)[0].strip()
    texts_between_fields = re.split(r"\{[^{}]+\}", real_recordings.TEXT.read_text("utf-8").strip())
    assert re.fullmatch(".+?".join(map(re.escape, texts_between_fields)), text, re.DOTALL)
    assert not re.search(r"\{[a-z]", text)
    assert real_recordings.sources_table() in text
