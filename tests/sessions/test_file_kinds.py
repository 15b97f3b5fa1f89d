"""Files that are not what their name says: every reader names what they are, and an error ends in what to do."""

from functools import partial

import pytest

from replay.errors import ReplayError
from replay.studies.class_study.codebook import read_codebook
from replay.studies.class_study.joining import read_rows
from replay.studies.class_study.published import check_published
from sessions.doctor.examine import examine
from sessions.errors import SessionError
from sessions.importers import import_session
from sessions.importers.contacts_csv import read_contacts
from sessions.importers.csv_columns_and_units import read_mapping
from sessions.importers.ledger import Ledger
from sessions.mcap.reader import read_session
from sessions.meshes.mesh_files import load_mesh
from sessions.meshes.mesh_match import read_colliders
from sessions.scene_files.scene_toml import read_scene

FILES = {
    "an HTML page": b"\xef\xbb\xbf\n<!DOCTYPE html>\n<html><head><title>Sign in, please</title></head></html>",
    "an error message of a server in JSON": b'{"error": {"code": 403, "message": "Forbidden"}}\n',
    "an error message of a server in XML": b'<?xml version="1.0"?>\n<Error><Code>AccessDenied</Code></Error>',
    "a pointer of Git LFS": b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n",
    "another archive": b"PK\x03\x04" + bytes(26) + b"take/log.csv\x80",
    "UTF-16": "time,a_x,a_y,a_z\r\n0,1,2,3\r\n".encode("utf-16"),
    "a PDF": b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n",
    "empty": b"",
}
READERS = {
    **{f"import {name}": ("take", partial(import_session, name)) for name in ("auto", "csv", "optitrack", "mcap")},
    "import aframe": ("take.json", partial(import_session, "aframe")),
    "import mjcf": ("take.xml", partial(import_session, "mjcf")),
    "contacts": ("c.csv", lambda path: read_contacts(path, Ledger(path))),
    "mapping": ("m.toml", read_mapping),
    "scene": ("s.toml", read_scene),
    "session": ("s.mcap", read_session),
    "glb": ("m.glb", load_mesh),
    "obj": ("m.obj", load_mesh),
    "stl": ("m.stl", load_mesh),
    "colliders": ("m.glb", partial(read_colliders, names=None)),
    "answers": ("a.csv", read_rows),
    "codebook": ("c.yaml", read_codebook),
    "printed tables": ("t.toml", check_published),
}
ACCEPTED = {("answers", "UTF-16"), ("answers", "empty")}
"""(Reader, kind of file) that are read: a spreadsheet's text may be in UTF-16, a table of answers without rows."""


@pytest.mark.parametrize("kind", FILES)
def test_every_reader_names_a_file_of_another_kind(tmp_path, kind):
    """A file is called as each reader expects, and holds something else (FILES), as after a failed download.

    The error says the kind, the file's name and, behind a semicolon, what to do.
    """
    for reader, (name, read) in READERS.items():
        if (reader, kind) in ACCEPTED:
            continue
        (tmp_path / name).write_bytes(FILES[kind])
        with pytest.raises((SessionError, ReplayError)) as raised:
            read(tmp_path / name)
        message = str(raised.value)
        for text in (kind, name, "; "):
            assert text in message, f"{reader}: {message}"


@pytest.mark.parametrize("kind", ["an HTML page", "an error message of a server in JSON"])
@pytest.mark.parametrize("name", ["s.mcap", "m.glb", "s.toml"])
def test_doctor_refuses_a_page_in_place_of_a_file(tmp_path, kind, name):
    """The doctor examines a session, a mesh or a scene for damage; this file holds what a server sent instead."""
    (tmp_path / name).write_bytes(FILES[kind])
    with pytest.raises(SessionError, match=f"file .*{name} is {kind}"):
        examine(tmp_path / name)


def test_line_of_json_above_a_table_is_no_json_file(tmp_path):
    """A CSV has {"unit": "m"} above its header: it is no file in JSON, and only lacks a mapping of its columns."""
    rows = "".join(f"{k / 60:.4f},{k / 60:.4f},1,0,0,0,0,1\n" for k in range(30))
    (tmp_path / "log.csv").write_text('{"unit": "m"}\ntime,cup_x,cup_y,cup_z,cup_qx,cup_qy,cup_qz,cup_qw\n' + rows)
    with pytest.raises(SessionError, match="describe them with --mapping"):
        import_session("csv", tmp_path / "log.csv")
