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
    made = list(real_recordings.rows(None))
    assert len(made) >= 5
    for cells in made:
        assert cells[: -real_recordings.TIMES] == printed_rows[cells[0]][: -real_recordings.TIMES]


def test_every_recording_has_row_source_and_fetch_command(real_recordings, printed_rows, tmp_path):
    names = [item.name for item in real_recordings.RECORDINGS]
    assert [name for name in printed_rows if name in names] == names and len(names) >= 8
    lines = list(real_recordings.fetch_commands(tmp_path))
    assert all(shlex.split(line) for line in lines)
    for item in real_recordings.RECORDINGS:
        assert item.repository in page("results") and re.fullmatch("[0-9a-f]{40}", item.commit)
        assert any(f"{item.commit}:{item.path}" in line and line.endswith(item.file) for line in lines)


@pytest.mark.parametrize("yaw", [0.0, 35.0])
def test_two_posts_stand_beside_a_headset_in_any_direction(real_recordings, tmp_path, yaw):
    """Walls of both posts are 5 cm beside the headset, whichever way it looks."""
    rotation = Rotation.from_euler("y", yaw, degrees=True)
    x, y, z, w = rotation.as_quat()
    file, mapping = tmp_path / "subject.txt", tmp_path / "columns.toml"
    cells = f"1.0,1.2,0.5,{x},{y},{z},{w}"
    lines = [f"09:30:{k / 90:09.6f},{device},{cells}" for k in range(300) for device in ("H", "T")]
    file.write_text("\n".join(["Time,Device,X,Y,Z,qX,qY,qZ,qW", *lines]), encoding="utf-8")
    mapping.write_text(real_recordings.CLASS_MAPPING, encoding="utf-8")
    session = real_recordings.participant_session(file, "P99", mapping)
    assert session.facts["pseudonym"] == "P99" and set(session.tracks) == {"headset", "left post", "right post"}
    placed = {}
    for name, track in session.tracks.items():
        vertices = session.meshes[name].vertices
        placed[name] = vertices @ Rotation.from_quat(track.quaternions_xyzw[0]).as_matrix().T + track.positions[0]
    # A post's wall is a plane: as far from the headset as its farthest corner on that side.
    (left, right), head = (placed[f"{side} post"] for side in ("left", "right")), placed["headset"]
    across = right.mean(axis=0) - left.mean(axis=0)
    across /= np.linalg.norm(across)
    gaps = [(right @ across).min() - (head @ across).max(), (head @ across).min() - (left @ across).max()]
    assert np.allclose(gaps, 0.05, atol=2e-3)


def test_section_of_the_page_is_the_template_filled_in(real_recordings):
    text = page("results").partition(real_recordings.BEGIN)[2].partition(real_recordings.END)[0].strip()
    literal = re.split(r"\{[^{}]+\}", real_recordings.TEXT.read_text("utf-8").strip())
    assert re.fullmatch(".+?".join(map(re.escape, literal)), text, re.DOTALL) and not re.search(r"\{[a-z]", text)
    assert real_recordings.sources_table() in text
