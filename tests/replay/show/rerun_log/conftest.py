"""A run for tests of the picture: a slow detector misses taps on thin walls."""

from bisect import bisect_right
from functools import cache

import numpy as np
import pytest
from rerun.chunk import RrdReader
from support.shapes import box_mesh, revolved_mesh
from support.small_worlds import jumping, session_of_frames

from cdcore import TriangleMesh
from replay.engine import compute
from replay.show.rerun_log.recording import write_recording
from sessions import MeshData, Scene, Session
from sessions.model.scene import SceneBody

FRAMES, RATE = 90, 90.0
ORACLE, SUBJECT = "hybrid", "22.5Hz"
BEAKER_RADIUS, ROD_RADIUS = 0.033, 0.003


def lathe(profile, sides=40):
    """A closed profile of (radius, height) turned about +Y."""
    upright = revolved_mesh(profile, sides)
    return TriangleMesh(upright.vertices[:, [1, 2, 0]], upright.faces)


MESHES = {
    "bench": lambda: box_mesh((1.2, 0.04, 0.7)),
    "beaker": lambda: lathe(
        [(0, 0), (0.035, 0), (0.035, 0.095), (BEAKER_RADIUS, 0.095), (BEAKER_RADIUS, 0.002), (0, 0.002)]
    ),
    "rod": lambda: lathe([(0, 0), (ROD_RADIUS, 0), (ROD_RADIUS, 0.2), (0, 0.2)], sides=12),
    "hand": lambda: box_mesh((0.07, 0.03, 0.09)),
    "headset": lambda: box_mesh((0.18, 0.1, 0.1)),
}
TAGS = {
    "bench": ("furniture",),
    "beaker": ("plastic",),
    "rod": ("glass", "rod"),
    "hand": ("hand",),
    "headset": ("headset",),
}
PAIRS = [("beaker", "rod"), ("rod", "hand"), ("bench", "rod")]


def tapping():
    """Stamps, translations (T, 5, 3) and validity: the rod taps a wall 6 times a second, and once the bench."""
    stamps = 1_000_000_000 + np.arange(FRAMES) * 11_111_111
    t = np.arange(FRAMES) / RATE
    positions = np.zeros((FRAMES, len(MESHES), 3))
    positions[:, 1] = [0.0, 0.0201, 0.0]
    reach = BEAKER_RADIUS - ROD_RADIUS - 0.004 + 0.0045 * np.sin(6 * 2 * np.pi * t)
    rotation = 0.9 * t
    dip = 0.028 - 0.01 * (np.abs(np.arange(FRAMES) - 0.8 * FRAMES) < 6)
    positions[:, 2] = np.stack([reach * np.cos(rotation), dip, reach * np.sin(rotation)], axis=1)
    positions[:, 3] = positions[:, 2] + [0.02, 0.17, 0.0]
    positions[:, 4] = [0.25, 0.55, 0.7]
    valid = np.ones((FRAMES, len(MESHES)), dtype=bool)
    valid[FRAMES // 2 : FRAMES // 2 + 6, 3] = False
    return stamps, positions, valid


@cache
def demo_run(label=SUBJECT, name="discrete", **settings):
    """A second at 90 Hz, looked at by ``hybrid`` and by another, else ``discrete`` at 22.5 Hz."""
    stamps, positions, valid = tapping()
    bare = session_of_frames(stamps, valid, positions, names=list(MESHES))
    drawn_frames = {"rod": "right", "hand": "right"}
    bodies = [SceneBody(body, shape="mesh", tags=TAGS[body], group=drawn_frames.get(body, "")) for body in MESHES]
    meshes = {body: make() for body, make in MESHES.items()}
    session = Session(
        bare.frames,
        {body: MeshData(mesh.vertices, mesh.faces) for body, mesh in meshes.items()},
        Scene("taps", tuple(bodies)),
    )
    text = ",".join(f"{key}={value}" for key, value in (settings or {"rate_hz": 22.5}).items())
    return compute(session, detectors=f"{label}={name}[{text}]", oracle=ORACLE, pairs=PAIRS)


class Read:
    """Contents of a recording, entity by entity, as the file says."""

    def __init__(self, path, result):
        self.path = path
        stamps, times = result.assembly.stamp_ns, result.assembly.motion.times
        self.ns = (stamps - stamps[:1] + np.round(1e9 * times[:1]).astype(int)).tolist()
        self.entities = {}
        self._columns = {}
        for chunk in RrdReader(path).stream().to_chunks():
            self.entities.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())

    def column(self, entity, component):
        """Rows (session nanoseconds, frame, values) of one component in order of time; static rows have no times."""
        if (entity, component) not in self._columns:
            self._columns[entity, component] = self._column(entity, component)
        return self._columns[entity, component]

    def _column(self, entity, component):
        result = []
        for batch in self.entities.get("/" + entity, []):
            if component in batch.schema.names:
                values = batch.column(component).to_pylist()
                at = [None] * len(values)
                if "session" in batch.schema.names:
                    at = batch.column("session").cast("int64").to_pylist()
                frames = [None if ns is None else bisect_right(self.ns, ns) - 1 for ns in at]
                result += [row for row in zip(at, frames, values, strict=True) if row[2] is not None]
        return sorted(result, key=lambda row: -1 if row[0] is None else row[0])

    def lane(self, entity):
        """Changes of a lane: (session nanoseconds, state)."""
        return [(ns or 0, values[0]) for ns, _, values in self.column(entity, "StateChange:state")]

    def at(self, entity, component, frame):
        """Values of a component that a viewer shows at a frame: its latest row."""
        return self.at_ns(entity, component, self.ns[frame])

    def at_ns(self, entity, component, ns):
        """Values of a component that a viewer shows with the cursor at a time of the session."""
        rows = [row for row in self.column(entity, component) if row[0] is not None and row[0] <= ns]
        return list(rows[-1][2]) if rows else []


@pytest.fixture(scope="session")
def drawn(tmp_path_factory):
    """Draws a run and reads its picture back; each run once."""

    @cache
    def picture(result):
        path = tmp_path_factory.mktemp("run") / "run.rrd"
        write_recording(result, path)
        return Read(path, result)

    return picture


@pytest.fixture(scope="session")
def taps():
    """Makes other runs of the same taps."""
    return demo_run


@pytest.fixture(scope="session")
def demo():
    """A second of taps, audited."""
    return demo_run()


@pytest.fixture(scope="session")
def read(demo, drawn):
    """The picture of the demo, read back."""
    return drawn(demo)


@pytest.fixture(scope="session")
def recording(read):
    """The picture of the demo."""
    return read.path


@pytest.fixture(scope="session")
def searching():
    """A run with a search that misses."""
    return demo_run("paper", "hybrid-qaco", variant="corrected", budget=300)


@pytest.fixture(scope="session")
def passed():
    """A cube jumps through another between the frames 1 and 2, and is met at the frames 5 and 6."""
    return compute(jumping(), detectors="exact", oracle="continuous")
