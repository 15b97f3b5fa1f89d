"""A shrunk fault as a folder: a test that fails while the detector is wrong, its input, and a report."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from cdcore import TriangleMesh
from replay.detection.detector_spec import spec_text
from replay.show.results.run_folder import FolderKind, check_target, result_folder, write_summary
from replay.studies.shrink.reduce import Size
from replay.studies.shrink.well_posed import doubts_of
from replay.studies.shrink.wrong_answer import WrongAnswer
from replay.words import plural, safe_text

CASE_FOLDER: Final = FolderKind("case", "case.json", "vrlab-replay/case/1")
POSES_FILE: Final = "poses.csv"
TEST_SOURCE: Final = '''"""Fails while the detector of case.json answers wrongly about the last frame of poses.csv.

Another detector: DETECTOR=exact python -m pytest test_case.py
"""

import csv
import json
import os
from pathlib import Path

import numpy as np

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector

HERE = Path(__file__).parent
CASE = json.loads((HERE / "case.json").read_text(encoding="utf-8"))
NAME = os.environ.get("DETECTOR", CASE["detector"])
SETTINGS = CASE["settings"] if NAME == CASE["detector"] else {}


def body(name, file):
    words = [line.split() for line in (HERE / file).read_text(encoding="utf-8").splitlines()]
    vertices = [[float(one) for one in row[1:]] for row in words if row and row[0] == "v"]
    faces = [[int(one) - 1 for one in row[1:]] for row in words if row and row[0] == "f"]
    return Body(name, TriangleMesh(vertices, faces))


def motion(count):
    with (HERE / "poses.csv").open(newline="", encoding="utf-8") as file:
        rows = [row[:1] + row[2:] for row in list(csv.reader(file))[1:]]
    values = np.array(rows, dtype=float).reshape(-1, count, 14)
    given = np.nan_to_num(values[:, :, 2:])
    return Motion(values[:, 0, 0], given[:, :, :3], given[:, :, 3:].reshape(-1, count, 3, 3), values[:, :, 1] > 0)


def test_the_last_frame_is_answered_rightly():
    bodies = [body(*row) for row in CASE["bodies"]]
    detector = create_detector(NAME, bodies, pairs=CASE["pairs"], **SETTINGS)
    said = detector.detect(motion(len(bodies))).verdict[-1, 0]
    found = said in (Verdict.CONTACT, Verdict.CONTAINED, Verdict.CANDIDATE)
    assert found is CASE["contact"], f"{NAME} says {Verdict(said).name}"
'''
"""The same for every case: names, titles and settings of a run folder are data of ``case.json``, never code."""


def write_case(fault: WrongAnswer, before: Size, out: Path, *, source: str, force: bool = False) -> Path:
    """Write the folder of a fault: ``test_case.py``, OBJ files, ``poses.csv``, ``case.json``, a README.

    ``before``: its size when it was found; ``source``: where it was found, in a few words. Numbers are written as
    decimals that read back bit for bit. Raises ``OutputError``: the folder exists, or cannot be written.
    """
    check_target(out, force=force, kind=CASE_FOLDER)
    files = [f"body-{number}.obj" for number in range(1, len(fault.bodies) + 1)]
    with result_folder(out, CASE_FOLDER, force=force) as folder:
        for name, body in zip(files, fault.bodies, strict=True):
            (folder / name).write_text("".join(_obj(body.mesh)), encoding="utf-8")
        with (folder / POSES_FILE).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(_poses(fault))
        names = [body.name for body in fault.bodies]
        case: dict[str, Any] = {
            "schema": CASE_FOLDER.schema,
            "detector": fault.detector,
            "settings": dict(fault.settings),
            "oracle": fault.oracle,
            "contact": fault.contact,
            "bodies": [*zip(names, files, strict=True)],
            "pairs": fault.pairs.tolist(),
            "frames": len(fault.motion),
            "faces": Size.of(fault).faces,
            "doubts": sorted(doubts_of(fault)),
            "before": str(before),
            "source": source,
        }
        (folder / "test_case.py").write_text(TEST_SOURCE, encoding="utf-8")
        (folder / "README.md").write_text("\n".join(_report(fault, case)) + "\n", encoding="utf-8")
        write_summary(folder, CASE_FOLDER, case)
    return out


def sentence(fault: WrongAnswer) -> str:
    """Sentence on a fault: its detector, the missed or false contact, and its size."""
    verb = "misses a contact" if fault.contact else "invents a contact"
    size = Size.of(fault)
    first, second = (plural(count, "face") for count in size.faces)
    detector = safe_text(spec_text(fault.detector, fault.settings))
    return f"{detector} {verb} of {first} and {second} in {plural(size.frames, 'frame')}."


def _obj(mesh: TriangleMesh) -> Iterator[str]:
    yield from ("v " + " ".join(map(repr, row)) + "\n" for row in mesh.vertices.tolist())
    yield from ("f " + " ".join(str(corner + 1) for corner in row) + "\n" for row in mesh.faces.tolist())


def _poses(fault: WrongAnswer) -> Iterator[list[Any]]:
    """A row a frame and body: time, body, whether it has a pose, place, rotation by rows; seconds and metres."""
    yield ["time", "body", "valid", "x", "y", "z", *(f"r{row}{column}" for row in range(3) for column in range(3))]
    motion = fault.motion
    for frame, time in enumerate(motion.times.tolist()):
        for body, case_body in enumerate(fault.bodies):
            translation, rotation = motion.translations[frame, body], motion.rotations[frame, body]
            numbers = [*translation.tolist(), *rotation.ravel().tolist()]
            yield [repr(time), case_body.name, int(motion.valid[frame, body]), *map(repr, numbers)]


def _report(fault: WrongAnswer, case: Mapping[str, Any]) -> Iterator[str]:
    """A text for a bug report."""
    first, second = (safe_text(body.name) for body in fault.pair)
    yield f"# {sentence(fault)}"
    yield ""
    truth = "the surfaces or solids meet" if fault.contact else "nothing meets"
    yield f"In the last frame {truth} ({fault.oracle} says so); the detector says the opposite."
    yield f"The bodies are `{first}` and `{second}`. Found in {case['source']}: {case['before']}."
    yield "Shrunk until no frame and no face could be left out. Metres, seconds, columns of a rotation are body axes."
    yield from case["doubts"]
    yield ""
    yield "```"
    yield "python -m pytest test_case.py"
    yield f"DETECTOR={fault.oracle} python -m pytest test_case.py"
    yield "```"
