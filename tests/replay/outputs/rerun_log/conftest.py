"""A run put together by hand from real parts, for tests of the picture: a slow look misses taps on thin walls."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rerun.chunk import RrdReader
from support.shapes import box_mesh, revolved_mesh
from support.small_worlds import jumping

from cdcore import Body, Motion, TriangleMesh, create_detector
from replay.comparison.compare import compare
from replay.comparison.contact_counts import count_contacts
from replay.comparison.episodes import episodes
from replay.comparison.evidence import Evidence
from replay.comparison.false_contacts import FalseReporter, false_contacts
from replay.comparison.holding import holdings
from replay.comparison.misses import misses, stretches
from replay.outputs.rerun_log.recording import write_recording
from replay.pipeline.diagnosis import answers
from replay.pipeline.engine import compute
from replay.pipeline.ranking import ranking
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import score
from replay.pipeline.summary import look_figures
from replay.prepare.assembly import Assembly, PoseOrigin
from sessions import Scene, Session
from sessions.model.scene import SceneBody

RATE = 90.0
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
    "rod": lambda: lathe([(0, 0), (ROD_RADIUS, 0), (ROD_RADIUS, 0.2), (0, 0.2)], 12),
    "hand": lambda: box_mesh((0.07, 0.03, 0.09)),
    "headset": lambda: box_mesh((0.18, 0.1, 0.1)),
}
TAGS = {
    "bench": ("furniture",), "beaker": ("glass",), "rod": ("glass", "rod"), "hand": ("hand",), "headset": ("headset",),
}  # fmt: skip
PAIRS = [("beaker", "rod"), ("rod", "hand"), ("bench", "rod")]


def tapping(frames):
    """Stamps, translations (T, 5, 3) and validity: the rod taps a wall 6 times a second, and once the bench."""
    stamps = 1_000_000_000 + np.arange(frames) * 11_111_111
    t = np.arange(frames) / RATE
    places = np.zeros((frames, len(MESHES), 3))
    places[:, 1] = [0.0, 0.0201, 0.0]
    reach = BEAKER_RADIUS - ROD_RADIUS - 0.004 + 0.0045 * np.sin(6 * 2 * np.pi * t)
    turn = 0.9 * t
    dip = 0.028 - 0.01 * (np.abs(np.arange(frames) - 0.8 * frames) < 6)
    places[:, 2] = np.stack([reach * np.cos(turn), dip, reach * np.sin(turn)], axis=1)
    places[:, 3] = places[:, 2] + [0.02, 0.17, 0.0]
    places[:, 4] = [0.25, 0.55, 0.7]
    valid = np.ones((frames, len(MESHES)), dtype=bool)
    valid[frames // 2 : frames // 2 + 6, 3] = False
    return stamps, places, valid


def make_assembly(frames):
    stamps, places, valid = tapping(frames)
    bodies = tuple(Body(name, make()) for name, make in MESHES.items())
    names = [body.name for body in bodies]
    times = (stamps - stamps[0]) * 1e-9
    motion = Motion(times, places, np.broadcast_to(np.eye(3), (*places.shape[:2], 3, 3)), valid)
    pairs = np.array([[names.index(a), names.index(b)] for a, b in PAIRS])
    origin = np.where(valid, np.uint8(PoseOrigin.RECORDED), np.uint8(PoseOrigin.NONE))
    held = np.array([False, True, False])
    scene = Scene("taps", tuple(SceneBody(name, shape="mesh", tags=TAGS[name]) for name in names))
    still = [0.0, 0.0, 0.0, 1.0]
    poses = {name: (places[:, k], np.tile(still, (frames, 1))) for k, name in enumerate(names)}
    session = Session.from_arrays(stamps, poses, scene=scene)
    return session, Assembly(bodies, motion, pairs, held, stamps, origin, notes=("made up for a test",))


@cache
def demo_run(frames=270, label=SUBJECT, name="discrete", **settings):
    """Three seconds (or more) at 90 Hz, looked at by ``hybrid`` and by another, else ``discrete`` at 22.5 Hz."""
    session, assembly = make_assembly(frames)
    oracle = create_detector("hybrid", assembly.bodies, pairs=assembly.pairs)
    subject = create_detector(name, assembly.bodies, pairs=assembly.pairs, **(settings or {"rate_hz": 22.5}))

    def faces_of(motion):
        return oracle.detect(motion, faces=True)

    detections = {ORACLE: faces_of(assembly.motion), label: subject.detect(assembly.motion, faces=True)}
    found = {one: episodes(detection) for one, detection in detections.items()}
    held = holdings(assembly, None, found[ORACLE])
    comparison = compare(detections[label], detections[ORACLE], (label, ORACLE), holdings=held)
    places = stretches(comparison, found[ORACLE])
    evidence = Evidence(assembly, faces_of, [(one.pair, one.first, one.last) for one in places])
    names = [(assembly.bodies[i].name, assembly.bodies[j].name) for i, j in assembly.pairs.tolist()]
    result = RunResult(
        session=session, assembly=assembly, detections=detections, oracle=ORACLE, comparisons={label: comparison},
        episodes=found, misses={label: misses(places, names, assembly.motion.times, evidence)},
        detectors={label: subject}, holdings=held, counts={label: count_contacts(comparison, found[ORACLE])},
        false={label: false_contacts(assembly, comparison, FalseReporter(subject))},
    )  # fmt: skip
    return with_answers(replace(result, summary=figures(result)))


def with_answers(result):
    """A run with what the pipeline makes of its summary."""
    ranks = ranking(result.summary)
    return replace(result, ranking=ranks, answers=answers(result, result.summary, ranks))


def figures(result):
    """What the ranking reads of a summary."""
    made = {}
    for label, detection in result.detections.items():
        timed = look_figures(detection)
        frame = {} if timed is None else {"per_frame": timed}
        made[label] = {
            "name": label, "contacts": len(result.episodes[label]), "live": bool(frame), "faces_asked": True,
            "settings": {},
            "seconds": {"per_frame_mean": 1e-4, **frame},
        }  # fmt: skip
    return {
        "oracle": result.oracle, "detectors": made, "audit": {label: score(result, label) for label in result.misses},
    }  # fmt: skip


class Read:
    """What a recording holds, entity by entity, as the file says."""

    def __init__(self, path):
        self.path = path
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
        found = []
        for batch in self.entities.get("/" + entity, []):
            if component in batch.schema.names:
                values = batch.column(component).to_pylist()
                times = [
                    batch.column(name).cast("int64").to_pylist() if name in batch.schema.names else [None] * len(values)
                    for name in ("session", "frame")
                ]
                found += [row for row in zip(*times, values, strict=True) if row[2] is not None]
        return sorted(found, key=lambda row: -1 if row[0] is None else row[0])

    def lane(self, entity):
        """Changes of a lane: (session nanoseconds, state)."""
        return [(ns or 0, values[0]) for ns, _, values in self.column(entity, "StateChange:state")]

    def at(self, entity, component, frame):
        """What a viewer shows of a component at a frame: its latest row."""
        rows = [row for row in self.column(entity, component) if row[1] is not None and row[1] <= frame]
        return list(rows[-1][2]) if rows else []

    def at_ns(self, entity, component, ns):
        """What a viewer shows of a component with the cursor at a time of the session."""
        rows = [row for row in self.column(entity, component) if row[0] is not None and row[0] <= ns]
        return list(rows[-1][2]) if rows else []


@pytest.fixture(scope="session")
def demo():
    """Three seconds of taps, audited."""
    return demo_run()


@pytest.fixture(scope="session")
def taps():
    """Makes other runs of the same taps."""
    return demo_run


@pytest.fixture(scope="session")
def completed():
    """Makes what the pipeline makes of the summary of a run."""
    return with_answers


@pytest.fixture(scope="session")
def reader():
    """Reads a picture back."""
    return Read


@pytest.fixture(scope="session")
def recording(demo, tmp_path_factory):
    """The picture of the demo."""
    path = tmp_path_factory.mktemp("run") / "run.rrd"
    write_recording(demo, path)
    return path


@pytest.fixture(scope="session")
def read(recording):
    """The picture of the demo, read back."""
    return Read(recording)


@pytest.fixture(scope="session")
def passed():
    """A cube jumps through another between the frames 1 and 2, and is met at the frames 5 and 6."""
    return compute(jumping(), detectors="exact", oracle="continuous")


@pytest.fixture(scope="session")
def passed_read(passed, tmp_path_factory):
    """The picture of the jump, read back."""
    path = tmp_path_factory.mktemp("passed") / "run.rrd"
    write_recording(passed, path)
    return Read(path)


@pytest.fixture(scope="session")
def hundreds(tmp_path_factory):
    """Twenty seconds of taps, with more misses than anybody reads one by one, and its picture read back."""
    result, path = demo_run(1800), tmp_path_factory.mktemp("many") / "run.rrd"
    write_recording(result, path)
    return result, Read(path)


@pytest.fixture
def write(tmp_path):
    """Writes the picture of a run and reads it back."""

    def written(result):
        write_recording(result, tmp_path / "run.rrd")
        return Read(tmp_path / "run.rrd")

    return written
