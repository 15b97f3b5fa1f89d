"""Long tables, a row per body and time: which column tells bodies apart, and what of them would be lost."""

import re

import numpy as np
import pytest

from sessions.doctor.timing import typical_step
from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.importers.ledger import ledger_of
from sessions.model.session import Status

UIDS = (225397651484143, 194930206998778, 79582884925181, 270231216246839, 117658302265452, 223371871635142)
NAMES = ("mug", "bowl", "plate", "spoon", "can", "pot")
HEADINGS_WITH_UNITS = "t_wo_x[m],t_wo_y[m],t_wo_z[m],q_wo_w,q_wo_x,q_wo_y,q_wo_z"
HEADINGS_WITHOUT_UNITS = "x,y,z,qw,qx,qy,qz"
STEP_NS = 33_333_333
MOMENTS = 40
LATE_CAMERA_NS = 93_847
"""How much later the second of two cameras stamps the same moment: 0.1 ms of a step of 33 ms."""


def write_six_objects(
    path,
    *,
    ids=UIDS,
    headings=HEADINGS_WITH_UNITS,
    camera_delays_ns=(0,),
    rows_twice=0,
    object_delay_ns=0,
    is_sorted_by_object=False,
):
    """Writes 40 moments, 33 ms apart, of six objects: a row for each moment, object and camera; returns the path.

    Column ``object_uid`` says which object a row is of; its x is the moment, its y the number of the object.
    ``rows_twice``: so many of the first rows stand once more, at another place.
    """
    start_ns = 10**12
    rows = [
        (name, start_ns + moment * STEP_NS + delay + number * object_delay_ns, f"cam{camera}", moment, number, delay)
        for moment in range(MOMENTS)
        for number, name in enumerate(ids)
        for camera, delay in enumerate(camera_delays_ns)
    ]
    rows += [(name, stamp, camera, 0.5, number, 1) for name, stamp, camera, _x, number, _z in rows[:rows_twice]]

    def stamp_or_object(row):
        _name, stamp, _camera, _x, number, _z = row
        return (number, stamp) if is_sorted_by_object else stamp

    lines = [
        f"{name},{stamp},{camera},{x},{y},{z},1,0,0,0"
        for name, stamp, camera, x, y, z in sorted(rows, key=stamp_or_object)
    ]
    path.write_text(f"object_uid,timestamp[ns],camera,{headings}\n" + "\n".join(lines) + "\n")
    return path


def refusal_with_draft(path):
    """The error of a CSV imported without a mapping: ``draft`` is one to correct, ``unknown`` what it leaves open."""
    with pytest.raises(UnknownColumnsError) as caught:
        import_session("csv", path)
    return caught.value


def session_by_draft(path, draft):
    """The session of a CSV whose columns are as the mapping ``draft`` says, in axes of sessions."""
    mapping = path.with_suffix(".columns.toml")
    mapping.write_text(draft)
    return import_session("csv", path, mapping=mapping, convention="canonical")


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    ("table", "samples_of_an_object"),
    [
        pytest.param({}, MOMENTS, id="numbers as names"),
        pytest.param(
            {"headings": HEADINGS_WITHOUT_UNITS, "camera_delays_ns": (0, LATE_CAMERA_NS)}, 2 * MOMENTS, id="two cameras"
        ),
        pytest.param({"ids": NAMES, "object_delay_ns": 1000}, MOMENTS, id="objects one after the other"),
        pytest.param(
            {"ids": NAMES, "headings": HEADINGS_WITHOUT_UNITS, "is_sorted_by_object": True}, MOMENTS, id="sorted"
        ),
        pytest.param({"headings": HEADINGS_WITHOUT_UNITS, "rows_twice": 2}, MOMENTS, id="two rows twice"),
    ],
)
def test_six_objects_are_six_bodies_from_the_first_draft(tmp_path, table, samples_of_an_object):
    """A table of six objects, in several forms, is refused with a draft of a mapping that needs no change.

    The draft takes ``object_uid`` for the name of a row's body, expects to drop no rows, and by it each object gets a
    sample for each moment and camera.
    """
    path = write_six_objects(tmp_path / "six.csv", **table)
    refusal = refusal_with_draft(path)
    assert 'name = "object_uid"' in refusal.draft
    assert not [gap for gap in refusal.unknown if "rows" in gap]
    session = session_by_draft(path, refusal.draft)
    assert {*session.names} == {str(name) for name in table.get("ids", UIDS)}
    valid_samples = (session.frames.status == Status.VALID).sum(axis=0)
    assert valid_samples.tolist() == [samples_of_an_object] * len(UIDS)


@pytest.mark.parametrize(
    ("table", "cure"),
    [
        pytest.param(
            {"rows_twice": 60}, "60 of 300 rows would be dropped: .* keep one row of each body and stamp", id="twice"
        ),
        pytest.param(
            {"camera_delays_ns": (0, 0)},
            "240 of 480 rows would be dropped: .* keep the rows of one value of column 'camera'",
            id="two cameras",
        ),
    ],
)
def test_repeated_stamps_of_a_body_stop_with_their_cure(tmp_path, table, cure):
    """60 of 6 x 40 = 240 rows stand twice with other positions, or two cameras have all rows at the same stamps.

    The draft then has the name of a row's body as a comment only, so that no import by it succeeds unread.
    """
    path = write_six_objects(tmp_path / "six.csv", **table)
    refusal = refusal_with_draft(path)
    assert [gap for gap in refusal.unknown if re.search(cure, gap)]
    assert '# name = "object_uid"' in refusal.draft
    with pytest.raises(ImportFileError, match=r"give either \[body\]"):
        session_by_draft(path, refusal.draft)


LONG_HEAD = "time,object,x,y,z,qx,qy,qz,qw"
LONG_ROWS = [f"{step / 90:.6f},{name},{step},0,0,0,0,0,1" for step in range(MOMENTS) for name in ("cup", "rod")]


def test_rows_that_are_there_twice_are_merged(tmp_path):
    """Every fourth row of two bodies is repeated as it is: nothing is lost, and no question is left."""
    path = tmp_path / "log.csv"
    lines = [line for number, line in enumerate(LONG_ROWS) for line in [line] * (2 if number % 4 == 0 else 1)]
    path.write_text("\n".join([LONG_HEAD, *lines, ""]))
    refusal = refusal_with_draft(path)
    assert not [gap for gap in refusal.unknown if "rows" in gap]
    session = session_by_draft(path, refusal.draft)
    assert [len(session.tracks[name].times_ns) for name in ("cup", "rod")] == [MOMENTS, MOMENTS]
    merged = sum(sum(entry.merged.values()) for entry in ledger_of(session.facts))
    assert merged == len(LONG_ROWS) // 4


def test_shuffled_rows_are_to_be_sorted(tmp_path):
    """No row repeats a stamp of its body; in random order they go back in time, and the draft asks for sorted rows."""
    path = tmp_path / "log.csv"
    lines = np.random.default_rng(0).permutation(LONG_ROWS).tolist()
    path.write_text("\n".join([LONG_HEAD, *lines, ""]))
    assert any("they go back in time; sort the rows by their stamps" in gap for gap in refusal_with_draft(path).unknown)


@pytest.mark.parametrize(("column", "names"), [("gadget", ("rod", "cup")), ("dev", ("1", "2"))])
def test_bodies_whose_stamps_all_differ_are_separated(tmp_path, column, names):
    """Rows of two bodies alternate; the second body's stamp is 2 ms later, so that no stamp repeats. x is 0 or 1.

    The body is named by ``column``; "parity", which also has two values, may not be taken for it.
    """
    path = tmp_path / "log.csv"
    lines = [
        f"{step / 90 + 0.002 * x:.6f},{name},{step % 2},{x},{step / 900},0,0,0,0,1"
        for step in range(MOMENTS)
        for x, name in enumerate(names)
    ]
    path.write_text("\n".join([f"time,{column},parity,x,y,z,qx,qy,qz,qw", *lines, ""]))
    session = session_by_draft(path, refusal_with_draft(path).draft)
    assert session.names == names
    first, second = (session.tracks[name].positions[:, 0].tolist() for name in names)
    assert first == [0.0] * MOMENTS
    assert second == [1.0] * MOMENTS


def test_alternating_column_of_a_single_body_is_no_name(tmp_path):
    """The column "parity" is 0 and 1 in turn; times never repeat, so it names no body, and the file's name is taken."""
    path = tmp_path / "log.csv"
    lines = [f"{step / 90:.6f},{step % 2},{step / 900},1,0,0,0,0,1" for step in range(MOMENTS)]
    path.write_text("\n".join(["time,parity,x,y,z,qx,qy,qz,qw", *lines, ""]))
    assert session_by_draft(path, refusal_with_draft(path).draft).names == ("log",)


def test_body_columns_of_a_wide_table_keep_their_name(tmp_path):
    """Columns head_x ... are of a body "head", although a column "device" is HMD0 in 20 rows and HMD1 in 20 more."""
    path = tmp_path / "wide.csv"
    rows = (f"HMD{moment // 20},{moment * STEP_NS},{moment},0,0,1,0,0,0" for moment in range(MOMENTS))
    path.write_text("device,time_ns,head_x,head_y,head_z,head_qw,head_qx,head_qy,head_qz\n" + "\n".join(rows) + "\n")
    assert '[bodies."head"]' in refusal_with_draft(path).draft


def test_two_cameras_make_the_rate_of_their_moments(tmp_path):
    """The second camera stamps 0.1 ms after the first; the step of the session is that between moments, 33 ms."""
    path = write_six_objects(tmp_path / "six.csv", camera_delays_ns=(0, LATE_CAMERA_NS))
    session = session_by_draft(path, refusal_with_draft(path).draft)
    assert np.isclose(typical_step(session.stamps()), STEP_NS)
