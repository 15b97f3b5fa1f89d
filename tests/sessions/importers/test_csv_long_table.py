"""Long tables, a row per body and time: which column tells bodies apart, and what of them would be lost."""

import re

import numpy as np
import pytest

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.model.session import Status

UIDS = (225397651484143, 194930206998778, 79582884925181, 270231216246839, 117658302265452, 223371871635142)
TEXTS = ("mug", "bowl", "plate", "spoon", "can", "pot")
HEADINGS_WITH_UNITS = "t_wo_x[m],t_wo_y[m],t_wo_z[m],q_wo_w,q_wo_x,q_wo_y,q_wo_z"
HEADINGS_WITHOUT_UNITS = "x,y,z,qw,qx,qy,qz"
STEP_NS = 33_333_333
MOMENTS = 40
PAIRS = [(step, body) for step in range(MOMENTS) for body in range(2)]


def long_table(path, *, ids=UIDS, pose=HEADINGS_WITH_UNITS, cameras=(0,), repeated=0, stagger=0, by_body=False):
    """Writes a table of six objects; each of ``cameras`` stamps so many ns later, ``repeated`` rows stand twice."""
    rows = [
        (name, 10**12 + moment * STEP_NS + camera + position * stagger, f"cam{number}", moment, position, camera)
        for moment in range(MOMENTS)
        for position, name in enumerate(ids)
        for number, camera in enumerate(cameras)
    ]
    rows += [(name, stamp, camera, 0.5, position, 1) for name, stamp, camera, _, position, _ in rows[:repeated]]
    rows.sort(key=lambda row: (row[4], row[1]) if by_body else row[1])
    lines = [f"{name},{stamp},{camera},{x},{y},{z},1,0,0,0" for name, stamp, camera, x, y, z in rows]
    path.write_text(f"object_uid,timestamp[ns],camera,{pose}\n" + "\n".join(lines) + "\n")
    return path


def unknown_columns(path):
    """The refusal of a CSV whose columns nobody explains, with the draft of a mapping."""
    with pytest.raises(UnknownColumnsError) as caught:
        import_session("csv", path)
    return caught.value


def session_by_draft(path, draft):
    """The session that a CSV and a mapping, as text, give."""
    mapping = path.with_suffix(".columns.toml")
    mapping.write_text(draft)
    return import_session("csv", path, mapping=mapping, convention="canonical")


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    ("ids", "pose", "more"),
    [
        (UIDS, HEADINGS_WITH_UNITS, {}),
        (UIDS, HEADINGS_WITHOUT_UNITS, {"cameras": (0, 93_847)}),
        (TEXTS, HEADINGS_WITH_UNITS, {"stagger": 1000}),
        (TEXTS, HEADINGS_WITHOUT_UNITS, {"by_body": True}),
        (UIDS, HEADINGS_WITHOUT_UNITS, {"repeated": 2}),
    ],
    ids=str,
)
def test_six_objects_are_six_bodies_from_the_first_draft(tmp_path, ids, pose, more):
    """Bodies by number or by name; several cameras, staggered stamps, sorted by body, or rows that stand twice."""
    path = long_table(tmp_path / "six.csv", ids=ids, pose=pose, **more)
    error = unknown_columns(path)
    assert 'name = "object_uid"' in error.draft and not any("rows" in gap for gap in error.unknown)
    session = session_by_draft(path, error.draft)
    assert {*session.names} == {str(name) for name in ids}
    times = len(more.get("cameras", (0,))) * MOMENTS
    assert ((session.frames.status == Status.VALID).sum(axis=0) == times).all()


@pytest.mark.parametrize(
    ("more", "cure"),
    [
        ({"repeated": 60}, "60 of 300 rows would be dropped: .* keep one row of each body and stamp"),
        ({"cameras": (0, 0)}, "240 of 480 rows would be dropped: .* keep the rows of one value of column 'camera'"),
    ],
)
def test_repeated_stamps_of_a_body_stop_with_their_cure(tmp_path, more, cure):
    """60 of 240 rows stand twice with other numbers, or two cameras have all rows at the same stamps."""
    path = long_table(tmp_path / "six.csv", **more)
    error = unknown_columns(path)
    assert any(re.search(cure, gap) for gap in error.unknown)
    assert '# name = "object_uid"' in error.draft
    with pytest.raises(ImportFileError, match="bod"):
        session_by_draft(path, error.draft)


@pytest.mark.parametrize(("column", "names"), [("gadget", ("rod", "cup")), ("dev", ("1", "2"))])
def test_bodies_whose_stamps_all_differ_are_separated(tmp_path, column, names):
    """A column names the body of a row; neither the time nor another column of two values may be taken for it."""
    path = tmp_path / "log.csv"
    lines = [
        f"{step / 90 + body / 500:.6f},{names[body]},{step % 2},{body},{step / 900},0,0,0,0,1" for step, body in PAIRS
    ]
    path.write_text("\n".join([f"time,{column},parity,x,y,z,qx,qy,qz,qw", *lines, ""]))
    session = session_by_draft(path, unknown_columns(path).draft)
    assert session.names == names
    assert all((session.tracks[name].positions[:, 0] == body).all() for body, name in enumerate(names))


def test_alternating_column_of_a_single_body_is_no_name(tmp_path):
    """The column "parity" is 0 and 1 in turn; times never repeat, so it names no body."""
    path = tmp_path / "log.csv"
    lines = [f"{step / 90:.6f},{step % 2},{step / 900},1,0,0,0,0,1" for step in range(MOMENTS)]
    path.write_text("\n".join(["time,parity,x,y,z,qx,qy,qz,qw", *lines, ""]))
    assert session_by_draft(path, unknown_columns(path).draft).names == ("log",)


def test_body_columns_of_a_wide_table_keep_their_name(tmp_path):
    """Columns head_x ... are of a body "head", although a column "device" has two values, one after the other."""
    path = tmp_path / "wide.csv"
    rows = (f"HMD{moment // 20},{moment * STEP_NS},{moment},0,0,1,0,0,0" for moment in range(MOMENTS))
    path.write_text("device,time_ns,head_x,head_y,head_z,head_qw,head_qx,head_qy,head_qz\n" + "\n".join(rows) + "\n")
    assert '[bodies."head"]' in unknown_columns(path).draft


def test_two_cameras_make_the_rate_of_their_moments(tmp_path):
    """The second camera stamps 0.1 ms later; a step is that between moments, 33 ms."""
    from sessions.doctor.timing import typical_step

    path = long_table(tmp_path / "six.csv", cameras=(0, 93_847))
    session = session_by_draft(path, unknown_columns(path).draft)
    assert np.isclose(typical_step(session.stamps()), STEP_NS)
