"""A shrunk fault as a folder: a test that fails while the detector is wrong, its input, a picture, and a report."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore import TriangleMesh
from replay.base.shown import drawable, shown
from replay.outputs.palette import FOUND, INVENTED, MISSED, hex_of
from replay.outputs.results.run_folder import FolderKind, check_target, result_folder, write_summary
from replay.outputs.words import counted
from replay.studies.shrink.fault import Fault
from replay.studies.shrink.reduce import Size
from replay.studies.shrink.well_posed import doubts_of

CASE: Final = FolderKind("case", "case.json", "vrlab-replay/case/1", ())
POSES: Final = "poses.csv"
MOST_SHOWN: Final = 12
"""Faces and frames that the report prints in full."""

TEST: Final = '''"""Fails while the detector of case.json answers wrongly about the last frame of poses.csv.

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


def write_case(fault: Fault, before: Size, out: Path, *, source: str, force: bool = False) -> Path:
    """Write the folder of a fault: ``test_case.py``, OBJ files, ``poses.csv``, ``case.json``, a picture, a README.

    ``before``: its size when it was found; ``source``: where it was found, in a few words. Numbers are written as
    decimals that read back bit for bit. Raises ``OutputError``: the folder exists, or cannot be written.
    """
    check_target(out, force=force, kind=CASE)
    files = [f"body-{number}.obj" for number in range(1, len(fault.bodies) + 1)]
    with result_folder(out, CASE, force=force) as folder:
        for name, body in zip(files, fault.bodies, strict=True):
            (folder / name).write_text("".join(_obj(body.mesh)), encoding="utf-8")
        with (folder / POSES).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(_poses(fault))
        names = [body.name for body in fault.bodies]
        case: dict[str, Any] = {
            "schema": CASE.schema, "detector": fault.detector, "settings": dict(fault.settings), "oracle": fault.oracle,
            "contact": fault.contact, "bodies": [*zip(names, files, strict=True)], "pairs": fault.pairs.tolist(),
            "frames": len(fault.motion), "faces": Size.of(fault).faces, "doubts": sorted(doubts_of(fault)),
            "before": str(before), "source": source,
        }  # fmt: skip
        (folder / "test_case.py").write_text(TEST, encoding="utf-8")
        (folder / "README.md").write_text("\n".join(_report(fault, case)) + "\n", encoding="utf-8")
        (folder / "picture.png").write_bytes(_picture(fault))
        write_summary(folder, CASE, case)
    return out


def sentence(fault: Fault) -> str:
    """What is wrong, in a sentence: which detector misses or invents a contact of how much."""
    verb = "misses a contact" if fault.contact else "invents a contact"
    size = Size.of(fault)
    first, second = (counted(count, "face") for count in size.faces)
    return (
        f"{_written(fault.detector, fault.settings)} {verb} of {first} and {second} in {counted(size.frames, 'frame')}."
    )


def _written(name: str, settings: Mapping[str, Any]) -> str:
    words = ",".join(f"{key}={value}" for key, value in settings.items())
    return shown(f"{name}[{words}]" if words else name)


def _obj(mesh: TriangleMesh) -> Iterator[str]:
    yield from ("v " + " ".join(map(repr, row)) + "\n" for row in mesh.vertices.tolist())
    yield from ("f " + " ".join(str(corner + 1) for corner in row) + "\n" for row in mesh.faces.tolist())


def _poses(fault: Fault) -> Iterator[list[Any]]:
    """A row a frame and body: time, body, whether it has a pose, place, rotation by rows; seconds and metres."""
    yield ["time", "body", "valid", "x", "y", "z", *(f"r{row}{column}" for row in range(3) for column in range(3))]
    motion = fault.motion
    for frame, time in enumerate(motion.times.tolist()):
        for body, kept in enumerate(fault.bodies):
            place, turn = motion.translations[frame, body], motion.rotations[frame, body]
            numbers = [*place.tolist(), *turn.ravel().tolist()]
            yield [repr(time), kept.name, int(motion.valid[frame, body]), *map(repr, numbers)]


def _report(fault: Fault, case: Mapping[str, Any]) -> Iterator[str]:
    """A text for a bug report."""
    first, second = (shown(body.name) for body in fault.pair)
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
    if len(fault.motion) * len(fault.bodies) + sum(case["faces"]) <= MOST_SHOWN:
        yield ""
        for number, body in enumerate(fault.bodies, 1):
            corners = json.dumps(body.mesh.triangles.tolist())
            yield f"- triangles of body-{number}: `{corners}`"
        for frame, time in enumerate(fault.motion.times.tolist()):
            places = json.dumps(fault.motion.translations[frame].tolist())
            yield f"- {time!r} s: places `{places}`, rotations `{json.dumps(fault.motion.rotations[frame].tolist())}`"
    yield ""
    yield "![both bodies in the last frame](picture.png)"


def _picture(fault: Fault) -> bytes:
    """Both bodies in the last frame as PNG, the first filled; red where a contact is missed, yellow where invented."""
    import io

    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    figure = Figure(figsize=(6, 5), layout="constrained")
    axes: Any = figure.add_subplot(projection="3d")
    ends = fault.pairs[0].tolist()
    corners = [fault.corners(end) for end in ends]
    colours = hex_of(MISSED if fault.contact else INVENTED), hex_of(FOUND)
    for triangles, colour in zip(corners, colours, strict=True):
        axes.add_collection3d(
            Poly3DCollection(triangles, facecolor=colour, edgecolor="#222222", alpha=0.5, linewidth=0.5)
        )
    points = np.concatenate(corners).reshape(-1, 3)
    # A point has no extent, and the limits of an axis must differ.
    middle, half = (points.min(axis=0) + points.max(axis=0)) / 2, max(float(np.ptp(points, axis=0).max()) / 2, 1e-9)
    axes.set(**{f"{axis}lim": (middle[k] - half, middle[k] + half) for k, axis in enumerate("xyz")})
    axes.set(
        xlabel="x, m", ylabel="y, m", zlabel="z, m", title=" and ".join(drawable(body.name) for body in fault.pair)
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100, metadata={"Software": None})
    return buffer.getvalue()
