"""Rows repeated, reordered, removed, renamed and restamped: nothing above 1 % is lost without a warning.

Each sample is known by its x, a number of its own, so that losses are counted from what was written and what arrived.
"""

import json
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer
from support.mutants import MUTANTS
from support.session_files import samples, stream_header, xdf_file

from sessions.errors import ImportFileError
from sessions.importers import IMPORTERS, import_session
from sessions.importers.contacts_csv import read_contacts
from sessions.importers.ledger import Ledger, ledger_of

NAMES = ("cup", "rod")
STEPS = 60
STEP_NS = 10_000_000
RECORDS = [
    (name, STEP_NS * (step + 1), 1.0 + step + 1000 * body) for step in range(STEPS) for body, name in enumerate(NAMES)
]
"""Body, stamp in ns, and x of each row: 60 steps of 10 ms, x of the cup 1 to 60, of the rod 1001 to 1060."""
QUATERNION = [0.0, 0.0, 0.0, 1.0]


def repeated(records, first, last, _):
    """Rows of which some stand twice."""
    return [*records[:last], *records[first:last], *records[last:]]


def reordered(records, first, last, _):
    """Rows of which some stand backwards."""
    return [*records[:first], *reversed(records[first:last]), *records[last:]]


def moved_to_the_end(records, first, last, _):
    """Rows of which some stand last."""
    return [*records[:first], *records[last:], *records[first:last]]


def removed(records, first, last, _):
    """Rows without some."""
    return [*records[:first], *records[last:]]


def renamed(records, first, last, number):
    """Rows of which some are of another body."""
    name = (*NAMES, "flask")[number % 3]
    return [*records[:first], *((name, *rest) for _, *rest in records[first:last]), *records[last:]]


def restamped(records, first, last, number):
    """Rows of which some have a time that is much later, earlier, or half a step off."""
    ahead = (10**15, -(10**8), 5 * 10**9, STEP_NS // 2)[number % 4]
    wild = [(name, max(stamp + ahead, 0), x) for name, stamp, x in records[first:last]]
    return [*records[:first], *wild, *records[last:]]


def stuck(records, first, last, _):
    """Rows of which some have the time of the first of them."""
    return [*records[:first], *((name, records[first][1], x) for name, _, x in records[first:last]), *records[last:]]


CHANGES = (repeated, reordered, moved_to_the_end, removed, renamed, restamped, stuck)
EDITS = st.lists(
    st.tuples(st.sampled_from(CHANGES), st.integers(0, 119), st.sampled_from([1, 2, 3, 12, 60]), st.integers(0, 11)),
    min_size=1,
    max_size=3,
)


def mutant_of(edits):
    """RECORDS after these edits: a change of CHANGES, its first row, how many rows, and a number for the change."""
    records = RECORDS
    for change, first, count, number in edits:
        first %= len(records) or 1
        if records[first : first + count]:
            records = change(records, first, first + count, number)
    return records


def rows_by_body(records):
    """Body -> its rows (ns, x)."""
    bodies = {}
    for name, stamp, x in records:
        bodies.setdefault(name, []).append((stamp, x))
    return bodies


def unity_csv(folder, records):
    """The path of these rows as the Unity script logs them."""
    lines = [f"pose,{stamp / 1e9:.9f},{name},{x},0,0,0,0,0,1,1,," for name, stamp, x in records]
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"
    (folder / "take.csv").write_text("\n".join([head, *lines, ""]))
    return folder / "take.csv"


def aframe(folder, records):
    """The path of these rows as A-Frame records them."""

    def pose(stamp, x):
        position, angles = {"x": x, "y": 0, "z": 0}, {"x": 0, "y": 0, "z": 0}
        return {"timestamp": stamp / 1e6, "position": position, "rotation": angles}

    devices = {name: {"poses": [pose(*row) for row in rows]} for name, rows in rows_by_body(records).items()}
    (folder / "take.json").write_text(json.dumps(devices))
    return folder / "take.json"


def transforms(folder, records):
    """The path of these rows as Foxglove's transforms."""
    with (folder / "take.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel(
            "/tf", "json", writer.register_schema("foxglove.FrameTransform", "jsonschema", b"{}")
        )
        for name, stamp, x in records:
            position, rotation = {"x": x, "y": 0, "z": 0}, dict(zip("xyzw", QUATERNION, strict=True))
            time = {"sec": str(stamp // 10**9), "nsec": stamp % 10**9}
            message = {
                "timestamp": time,
                "parent_frame_id": "world",
                "child_frame_id": name,
                "translation": position,
                "rotation": rotation,
            }
            writer.add_message(channel, 5, json.dumps(message).encode(), 5)
        writer.finish()
    return folder / "take.mcap"


def motive(folder, records):
    """A row for each record of the first body, in which the other moves along; a renamed body renames its column."""
    names = [Counter(name for name, _, x in records if (x > 1000) == other).most_common(1) for other in (False, True)]
    first, second = (name[0][0] if name else "cup" for name in names)
    rows = [(stamp, x) for _, stamp, x in records if x < 1000]
    kinds = [["", "Type", *["Rigid Body"] * 14], ["", "Name", *[first] * 7, *[second] * 7], ["", "ID", *["A"] * 14]]
    kinds += [["", "", *(["Rotation"] * 4 + ["Position"] * 3) * 2], ["Frame", "Time (Seconds)", *[*"XYZW", *"XYZ"] * 2]]
    cells = [
        [k, f"{stamp / 1e9:.9f}", 0, 0, 0, 1, x, 0, 0, 0, 0, 0, 1, x + 1000, 0, 0] for k, (stamp, x) in enumerate(rows)
    ]
    lines = ["Format Version,1.23,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global", ""]
    lines += [",".join(map(str, row)) for row in (*kinds, *cells)]
    (folder / "take.csv").write_text("\n".join([*lines, ""]))
    return folder / "take.csv"


def trackers(folder, records):
    """The folder of these rows as UXF writes them."""
    shutil.rmtree(folder / "S001", ignore_errors=True)
    (folder / "S001").mkdir()
    (folder / "S001" / "trial_results.csv").write_text("trial_num,start_time,end_time\n1,0,1\n")
    for name, rows in rows_by_body(records).items():
        lines = [f"{stamp / 1e9:.9f},{x},0,0,0,0,0" for stamp, x in rows]
        head = "time,pos_x,pos_y,pos_z,rot_x,rot_y,rot_z"
        (folder / "S001" / f"{name}_movement_T001.csv").write_text("\n".join([head, *lines, ""]))
    return folder / "S001"


TYPES = ("PositionX", "PositionY", "PositionZ", "OrientationB", "OrientationC", "OrientationD", "OrientationA")


def streams(folder, records):
    """A stream for each stretch of records of a body, as of one that was interrupted and came back."""
    chunks = []
    for number, (name, rows) in enumerate(rows_by_body(records).items()):
        described = [{"label": kind, "type": kind, "object": name} for kind in TYPES]
        for half, samples_of_half in enumerate((rows[:30], rows[30:])):
            if samples_of_half:
                stamps = np.array([stamp / 1e9 for stamp, _ in samples_of_half])
                values = np.array([[x, 0, 0, *QUATERNION] for _, x in samples_of_half])
                chunks += [stream_header(2 * number + half + 1, "Mocap", "MoCap", described)]
                chunks += [samples(2 * number + half + 1, stamps, values)]
    return xdf_file(folder, *chunks)


OPENXR = {"convention": "openxr"}
WRITERS = {
    "aframe": (aframe, {}), "csv": (unity_csv, OPENXR), "mcap": (transforms, OPENXR), "optitrack": (motive, {}),
    "ros2": (transforms, OPENXR), "uxf": (trackers, {}), "xdf": (streams, {}),
}  # fmt: skip


def test_every_importer_has_a_writer_here():
    """WRITERS has all importers but three, whose files have no row a body and time.

    A motion of joints (mjcf) has one row for all bodies, a capsule of a hand two joints, and USD has time samples.
    """
    assert WRITERS.keys() == IMPORTERS.keys() - {"mjcf", "hands", "usd"}


def written_by(importer, records):
    """The x of every sample in the file for an importer, by the name of its body."""
    if importer != "optitrack":
        return {body: [x for _, x in rows] for body, rows in rows_by_body(records).items()}
    # Motive's rows hold both bodies: those of the cup, beside which the rod is 1000 further.
    of_cup = [x for _, _, x in records if x < 1000]
    return {"both": [*of_cup, *(x + 1000 for x in of_cup)]}


@pytest.mark.sampled(14)
@pytest.mark.parametrize("mutants", MUTANTS)
@pytest.mark.parametrize("importer", WRITERS)
def test_row_mutants_report_every_loss_above_1_percent(tmp_path, importer, mutants):
    """Two bodies have 60 rows each, of which random ones are repeated, moved, removed, renamed or restamped.

    An import that is not refused has as many samples as its ledger says were read and kept; where more than 1 % of a
    body's samples, known by their x, do not arrive, the ledger has a large loss.
    """
    write, options = WRITERS[importer]

    @settings(max_examples=mutants, database=None, deadline=None, suppress_health_check=[*HealthCheck])
    @given(EDITS)
    def every_sample_is_accounted_for(edits):
        records = mutant_of(edits)
        written = written_by(importer, records)
        path = write(tmp_path, records)
        try:
            session = import_session(importer, path, **options)
        except ImportFileError as error:
            assert Path(path).name in str(error)
            return
        ledger = ledger_of(session.facts)
        samples_kept = sum(entry.kept for entry in ledger if entry.kind == "samples")
        assert samples_kept == sum(map(len, session.tracks.values()))
        kind_of_a_row = "transforms" if importer in ("mcap", "ros2") else "samples"
        rows_read = sum(entry.read for entry in ledger if entry.kind == kind_of_a_row)
        assert rows_read == sum(map(len, written.values()))
        arrived = {float(x) for track in session.tracks.values() for x in track.positions[:, 0]}
        for xs in written.values():
            lost = {*xs} - arrived
            assert len(lost) <= 0.01 * len(xs) or ledger.large_losses(), (lost, ledger.sentences())

    every_sample_is_accounted_for()


@pytest.mark.parametrize("mutants", MUTANTS)
def test_of_row_mutants_of_contacts_every_row_arrives(tmp_path, mutants):
    """120 reports of contacts (time, body, table and a number, begin) are changed as the rows above are.

    All different reports arrive, equal ones once, and the ledger counts both.
    """
    path = tmp_path / "engine.csv"

    @settings(max_examples=mutants, database=None, deadline=None, suppress_health_check=[*HealthCheck])
    @given(EDITS)
    def every_row_arrives(edits):
        records = mutant_of(edits)
        path.write_text("".join(f"{stamp / 1e9:.9f},{name},table {x},begin\n" for name, stamp, x in records))
        if not records:
            return
        contacts = read_contacts(path, ledger := Ledger(path))
        expected = {(stamp, name, f"table {x}") for name, stamp, x in records}
        arrived = [(contact.time_ns, contact.body_a, contact.body_b) for contact in contacts]
        assert {*arrived} == expected
        assert len(arrived) == len(expected)
        assert [(entry.read, entry.kept) for entry in ledger] == [(len(records), len(expected))]

    every_row_arrives()
