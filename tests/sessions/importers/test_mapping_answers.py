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

DRAFT = """# My take.
# convention = "unity"   # which axes?
guessed = ["units", "time.unit"]
units = "m"

[time]
column = "t"
units = "stays"
"""


def assumption(subject, *bodies):
    """A guess that is open, about these bodies or the file."""
    return Assumption(subject, "before", Origin.GUESS, Confidence.OPEN, bodies=bodies)


@pytest.mark.parametrize(
    ("row", "value", "key", "expected"),
    [
        (assumption(Subject.POSE_AXES), "ros", "convention", "ros"),
        (assumption(Subject.LENGTH_UNIT), "mm", "units", "mm"),
        (assumption(Subject.MESH_AXES, "cup", "rod"), "y-up", "mesh_axes", ["cup=y-up", "rod=y-up"]),
        (assumption(Subject.MESH_UNIT, "cup"), "cm", "mesh_units", ["cup=cm"]),
        (assumption(Subject.COLLIDER_AXES, "cup"), "x-flipped", "collider_axes", "x-flipped"),
    ],
)
def test_written_answer_changes_only_its_key_of_the_mapping(tmp_path, row, value, key, expected):
    """A user's answer to an import's open question becomes a key of the mapping file and is no longer "guessed"."""
    mapping_file = tmp_path / "map.toml"
    mapping_file.write_text(DRAFT)
    assert write_answers(mapping_file, [(row, value)]) == [key]
    answered, draft = tomllib.loads(mapping_file.read_text()), tomllib.loads(DRAFT)
    assert answered.pop(key) == expected
    draft.pop(key, None)
    draft["guessed"] = [guessed_key for guessed_key in draft["guessed"] if guessed_key != key]
    assert answered == draft
    assert mapping_file.read_text().startswith("# My take.\n")  # the user's comment in the first line of the draft


EVERY_ANSWER = [
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
    """Seven answers change six lines: those of five keys, and the list "guessed"."""
    path = tmp_path / "map.toml"
    before = DRAFT.replace("\n", line_break).encode()
    path.write_bytes(before)
    for answer in EVERY_ANSWER:
        write_answers(path, [answer])
    data = tomllib.loads(path.read_text())
    assert data["mesh_units"] == ["cup=cm", "rod=mm"] and data["guessed"] == ["time.unit"]
    assert forget_mapping_answers(path) == 6 and path.read_bytes() == before
    assert forget_mapping_answers(path) == 0


def test_answer_for_a_body_keeps_units_of_others(tmp_path):
    """All meshes are in cm by the mapping; the answer says mm of the rod."""
    path = tmp_path / "map.toml"
    path.write_text('mesh_units = "cm"\n' + DRAFT)
    write_answers(path, [(assumption(Subject.MESH_UNIT, "rod"), "mm")])
    options = with_mapped_meshes(MeshOptions(), path)
    assert options.units_by_body(["cup", "rod"]) == {"": "cm", "rod": "mm"}


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
    """``text``: the mapping before. A key below [time] would belong to that table."""
    path = tmp_path / "map.toml"
    path.write_text(text)
    write_answers(path, [(assumption(Subject.COLLIDER_AXES, "cup"), "gltf")])
    written = path.read_text()
    assert tomllib.loads(written) == answered and (written.startswith(text) or written.endswith(text))


def test_a_later_answer_replaces_that_of_its_body_alone(tmp_path):
    """Cup and rod are y-up, and then the rod has its body's axes."""
    path = tmp_path / "map.toml"
    path.write_text(DRAFT)
    write_answers(path, [(assumption(Subject.MESH_AXES, "cup", "rod"), "y-up")])
    write_answers(path, [(assumption(Subject.MESH_AXES, "rod"), "body")])
    assert with_mapped_meshes(MeshOptions(), path).mesh_axes == ("cup=y-up", "rod=body")


def test_multi_line_key_of_a_mapping_is_not_rewritten(tmp_path):
    """The user's list of mesh_axes is over three lines."""
    path = tmp_path / "map.toml"
    text = 'mesh_axes = [\n  "cup=body",\n]\n' + DRAFT
    path.write_text(text)
    with pytest.raises(ImportFileError, match="cannot be changed in place; write it there: mesh_axes"):
        write_answers(path, [(assumption(Subject.MESH_AXES, "cup"), "y-up")])
    assert path.read_text() == text


@pytest.mark.parametrize("kind", ["glb", "stl"])
def test_the_next_import_by_the_mapping_asks_nothing(tmp_path, kind):
    """Axes of meshes are the only open question; once "gltf" is written to the mapping, none is open."""
    write_scene(tmp_path, "ros", kind)
    meshes = {name: tmp_path / f"{name}.{kind}" for name in ("tool", "plate")}
    again = lambda: import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes)  # noqa: E731
    (row,) = [row for row in recording_assumptions(again()) if row.is_open]
    write_answers(tmp_path / "map.toml", [(row, "gltf")])
    decided = recording_assumptions(again())
    assert not [row for row in decided if row.is_open]
    assert {row.value for row in decided if row.subject is Subject.MESH_AXES} == {"gltf"}


def test_mesh_axes_option_overrides_the_mapping(tmp_path):
    """The mapping says y-up, the option of the import body."""
    write_scene(tmp_path, "ros", "stl")
    (tmp_path / "map.toml").write_text('mesh_axes = ["y-up"]\n' + (tmp_path / "map.toml").read_text())
    meshes = {name: tmp_path / f"{name}.stl" for name in ("tool", "plate")}
    session = import_session(
        "csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes, mesh_axes="body"
    )
    assert {row.value for row in recording_assumptions(session) if row.subject is Subject.MESH_AXES} == {"body"}
