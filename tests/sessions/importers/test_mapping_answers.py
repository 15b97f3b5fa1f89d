import tomllib

import pytest
from support.planted_sessions import write_scene

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.given_meshes import MeshOptions
from sessions.importers.importing import with_mapped_meshes
from sessions.importers.mapping_answers import forget_mapping_answers, write_answers
from sessions.model.assumption import Assumption, Confidence, Origin, Subject
from sessions.scene_files.answers import recording_assumptions

MAPPING = """# My take.
# convention = "unity"   # which axes?
guessed = ["units", "time.unit"]
units = "m"

[time]
column = "t"
units = "stays"
"""
"""A mapping (a file that says what the columns of a CSV are) of which two values are guesses, not the user's word."""


def assumption(subject, *bodies):
    """An open question: a guess, about these bodies or, without any, about the file."""
    return Assumption(subject, "before", Origin.GUESS, Confidence.OPEN, bodies=bodies)


@pytest.mark.parametrize(
    ("question", "answer", "key", "expected"),
    [
        pytest.param(assumption(Subject.POSE_AXES), "ros", "convention", "ros", id="axes of poses"),
        pytest.param(assumption(Subject.LENGTH_UNIT), "mm", "units", "mm", id="unit of lengths"),
        pytest.param(
            assumption(Subject.MESH_AXES, "cup", "rod"), "y-up", "mesh_axes", ["cup=y-up", "rod=y-up"], id="mesh axes"
        ),
        pytest.param(assumption(Subject.MESH_UNIT, "cup"), "cm", "mesh_units", ["cup=cm"], id="unit of a mesh"),
        pytest.param(
            assumption(Subject.COLLIDER_AXES, "cup"), "x-flipped", "collider_axes", "x-flipped", id="collider axes"
        ),
    ],
)
def test_written_answer_changes_only_its_key_of_the_mapping(tmp_path, question, answer, key, expected):
    """A user's answer to an import's open question becomes a key of the mapping and leaves the list "guessed".

    All other keys, and the comment in the first line, are as before.
    """
    path = tmp_path / "map.toml"
    path.write_text(MAPPING)
    assert write_answers(path, [(question, answer)]) == [key]

    after, before = tomllib.loads(path.read_text()), tomllib.loads(MAPPING)
    assert after.pop(key) == expected
    before.pop(key, None)
    before["guessed"] = [guess for guess in before["guessed"] if guess != key]
    assert after == before
    assert path.read_text().startswith("# My take.\n")


ANSWERS = [
    (assumption(Subject.POSE_AXES), "ros"),
    (assumption(Subject.LENGTH_UNIT), "mm"),
    (assumption(Subject.MESH_AXES, "cup", "rod"), "y-up"),
    (assumption(Subject.MESH_UNIT, "cup"), "cm"),
    (assumption(Subject.COLLIDER_AXES, "cup"), "x-flipped"),
    (assumption(Subject.MESH_UNIT, "rod"), "mm"),
    (assumption(Subject.MESH_AXES, "rod"), "body"),
]


@pytest.mark.parametrize("line_break", ["\n", "\r\n"])
def test_forgetting_answers_restores_the_mapping_byte_by_byte(tmp_path, line_break):
    """Seven ANSWERS change six lines, which are brought back: those of five keys, and the list "guessed".

    Then no answer is there to be forgotten.
    """
    path = tmp_path / "map.toml"
    before = MAPPING.replace("\n", line_break).encode()
    path.write_bytes(before)
    for answer in ANSWERS:
        write_answers(path, [answer])
    answered = tomllib.loads(path.read_text())
    assert answered["mesh_units"] == ["cup=cm", "rod=mm"]
    assert answered["guessed"] == ["time.unit"]

    lines_brought_back = forget_mapping_answers(path)
    assert lines_brought_back == 6
    assert path.read_bytes() == before
    assert forget_mapping_answers(path) == 0


def test_answer_for_a_body_keeps_units_of_others(tmp_path):
    """All meshes are in cm by the mapping; the answer says mm of the rod. The key "" is every other body."""
    path = tmp_path / "map.toml"
    path.write_text('mesh_units = "cm"\n' + MAPPING)
    write_answers(path, [(assumption(Subject.MESH_UNIT, "rod"), "mm")])
    options = with_mapped_meshes(MeshOptions(), path)
    assert options.units_by_body(names=["cup", "rod"]) == {"": "cm", "rod": "mm"}


@pytest.mark.parametrize(
    ("text", "answered"),
    [
        ('units = "m"', {"units": "m", "collider_axes": "gltf"}),
        ('[time]\ncolumn = "t"', {"collider_axes": "gltf", "time": {"column": "t"}}),
        ("# nothing yet", {"collider_axes": "gltf"}),
    ],
    ids=["no last line break", "a table alone", "a comment alone"],
)
def test_answer_is_written_above_all_tables(tmp_path, text, answered):
    """``text`` is the mapping before and stays whole, above or below the answer; a key below [time] would be [time]'s.

    Axes of colliders are a key for all bodies, so that the answer about the cup names none.
    """
    path = tmp_path / "map.toml"
    path.write_text(text)
    write_answers(path, [(assumption(Subject.COLLIDER_AXES, "cup"), "gltf")])
    written = path.read_text()
    assert tomllib.loads(written) == answered
    assert written.startswith(text) or written.endswith(text)


def test_a_later_answer_replaces_that_of_its_body_alone(tmp_path):
    """The first answer says y-up of the meshes of cup and rod, the second "body" of the rod's (axes of its poses)."""
    path = tmp_path / "map.toml"
    path.write_text(MAPPING)
    write_answers(path, [(assumption(Subject.MESH_AXES, "cup", "rod"), "y-up")])
    write_answers(path, [(assumption(Subject.MESH_AXES, "rod"), "body")])
    assert with_mapped_meshes(MeshOptions(), path).mesh_axes == ("cup=y-up", "rod=body")


def test_multi_line_key_of_a_mapping_is_not_rewritten(tmp_path):
    """The user's list of mesh_axes is over three lines: the answer is refused, and the file stays as it is."""
    path = tmp_path / "map.toml"
    text = 'mesh_axes = [\n  "cup=body",\n]\n' + MAPPING
    path.write_text(text)
    with pytest.raises(ImportFileError, match="cannot be changed in place; write it there: mesh_axes"):
        write_answers(path, [(assumption(Subject.MESH_AXES, "cup"), "y-up")])
    assert path.read_text() == text


@pytest.mark.parametrize("kind", ["glb", "stl"])
def test_the_next_import_by_the_mapping_asks_nothing(tmp_path, kind):
    """A CSV of a tool and a plate in axes of ROS has a mapping and a mesh file for each of the two bodies.

    Only the axes of the meshes are open; once the answer "gltf" is written to the mapping, nothing is.
    """
    write_scene(tmp_path, convention="ros", kind=kind)

    def imported_assumptions():
        meshes = {name: tmp_path / f"{name}.{kind}" for name in ("tool", "plate")}
        session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes)
        return recording_assumptions(session)

    (question,) = [row for row in imported_assumptions() if row.is_open]
    assert question.subject is Subject.MESH_AXES
    write_answers(tmp_path / "map.toml", [(question, "gltf")])
    decided = imported_assumptions()
    assert not [row for row in decided if row.is_open]
    assert [row.value for row in decided if row.subject is Subject.MESH_AXES] == ["gltf"]


def test_mesh_axes_option_overrides_the_mapping(tmp_path):
    """A CSV of a tool and a plate in axes of ROS: its mapping says y-up of the meshes, the import's option "body"."""
    write_scene(tmp_path, convention="ros", kind="stl")
    (tmp_path / "map.toml").write_text('mesh_axes = ["y-up"]\n' + (tmp_path / "map.toml").read_text())
    meshes = {name: tmp_path / f"{name}.stl" for name in ("tool", "plate")}
    session = import_session(
        "csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes, mesh_axes="body"
    )
    assert {row.value for row in recording_assumptions(session) if row.subject is Subject.MESH_AXES} == {"body"}
