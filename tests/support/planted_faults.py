"""A clean session, and everything that can be wrong with one: planted singly or together, with what must be found."""

import re
from dataclasses import dataclass, field

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from support.mutants import MESSAGE, with_messages
from support.small_worlds import cube

from sessions import Frames, MeshData, Session, Status, write_session

FRAMES = 900
STEP_NS = 11_111_111
START_NS = 1_700_000_000_000_000_000
BODIES = ("flask", "hand-left", "tray")
FIELDS = ("stamp_ns", "log_ns", "sample_ns", "position", "quaternion_xyzw", "status")
POSE_CHANNEL = 1
"""The first channel that a session file declares."""


@dataclass
class Draft:
    """Arrays and meshes of a session that faults are planted in, and what is to be done to the bytes of its file."""

    arrays: dict
    meshes: dict
    changes: list = field(default_factory=list)

    def session(self):
        """The session in memory."""
        return Session(Frames(BODIES, *(self.arrays[name].copy() for name in FIELDS)), self.meshes)

    def write(self, path):
        """Write the session as a file."""
        write_session(self.session(), path)
        for change in self.changes:
            path.write_bytes(change(path.read_bytes()))
        return path

    def shift(self, rows, by):
        """Move some frames in time."""
        for name in FIELDS[:3]:
            self.arrays[name][rows] += by


@dataclass(frozen=True)
class Planted:
    """A finding that must come: code, body, and rows of the frames that the finding covers (``None``: no span)."""

    code: str
    body: str
    rows: tuple | None

    def is_found(self, findings, draft):
        """Whether a finding says exactly this."""
        span = (None, None)
        if self.rows is not None:
            span = tuple(int(draft.arrays["stamp_ns"][row]) for row in self.rows)
        return any(
            (item.code, item.body, (item.start_ns, item.end_ns)) == (self.code, self.body, span) for item in findings
        )


def clean_draft():
    """Ten seconds: a flask carried about, a hand that swings and turns, a tray at rest."""
    stamps = START_NS + STEP_NS * np.arange(FRAMES)
    t = np.arange(FRAMES) / 90.0
    position = np.zeros((FRAMES, 3, 3))
    position[:, 0] = np.stack([0.3 * np.cos(0.7 * t), 1.0 + 0.1 * np.sin(1.3 * t), 0.3 * np.sin(0.7 * t)], axis=1)
    position[:, 1] = np.stack([0.4 * np.sin(1.1 * t), 1.2 + 0.2 * np.cos(0.9 * t), -0.4 + 0.1 * np.sin(2 * t)], axis=1)
    position[:, 2] = [0.0, 0.8, -0.3]
    half = 0.3 * np.sin(np.outer(t, [0.5, 0.8, 0.0]))
    quaternion = np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], axis=-1)
    status = np.full((FRAMES, 3), Status.VALID, dtype=np.uint8)
    arrays = (stamps, stamps + 2_000_000, np.repeat(stamps[:, None], 3, axis=1), position, quaternion, status)
    return Draft(dict(zip(FIELDS, arrays, strict=True)), {name: cube(0.1) for name in BODIES})


def fault(code, last=0, *, of_body=True, first=0):
    """A function that plants a fault, found in frames ``frame + first`` to ``frame + last``."""

    def planting(plant):
        def planted(draft, body, frame):
            plant(draft, body, frame)
            rows = None if last is None else (frame + first, min(frame + last, FRAMES - 1))
            return Planted(code, BODIES[body] if of_body else "", rows)

        return planted

    return planting


@fault("not-finite", 2)
def nan_position(draft, body, frame):
    """A position that is no number, in three frames."""
    draft.arrays["position"][frame : frame + 3, body, 1] = np.nan


@fault("zero-quaternion")
def zero_quaternion(draft, body, frame):
    """A rotation of length 0, in a frame."""
    draft.arrays["quaternion_xyzw"][frame, body] = 0.0


@fault("non-unit-quaternion", 4)
def non_unit_quaternion(draft, body, frame):
    """Rotations of length 1.1, in five frames."""
    draft.arrays["quaternion_xyzw"][frame : frame + 5, body] *= 1.1


@fault("time-backwards", 3, of_body=False)
def time_backwards(draft, body, frame):
    """Stamps half a second earlier, in four frames."""
    draft.shift(slice(frame, frame + 4), -500_000_000)


@fault("duplicate-stamps", 1, of_body=False)
def duplicate_stamps(draft, body, frame):
    """Two frames with the stamp of the frame before."""
    for name in FIELDS[:3]:
        draft.arrays[name][frame : frame + 2] = draft.arrays[name][frame - 1]


@fault("gap", first=-1, of_body=False)
def gap(draft, body, frame):
    """A second without frames."""
    draft.shift(slice(frame, None), 1_000_000_000)


@fault("frozen", 59)
def frozen(draft, body, frame):
    """Sixty frames with the pose of the frame before."""
    for name in ("position", "quaternion_xyzw"):
        draft.arrays[name][frame : frame + 60, body] = draft.arrays[name][frame - 1, body]


def teleport(size):
    """A jump of so many metres that stays."""

    @fault("teleport")
    def jump(draft, body, frame):
        draft.arrays["position"][frame:, body] += size * np.array([0.6, 0.0, 0.8])

    return jump


def millimetres(draft, body, frame):
    """All positions of a body in millimetres."""
    draft.arrays["position"][:, body] *= 1000.0
    return Planted("unit-suspect", BODIES[body], (0, FRAMES - 1))


@fault("clock-skew", FRAMES, of_body=False)
def log_skew(draft, body, frame):
    """A clock of the log that jumps by 5 s."""
    draft.arrays["log_ns"][frame:] += 5_000_000_000


@fault("clock-skew", FRAMES)
def device_skew(draft, body, frame):
    """A clock of the device that falls back by 5 s."""
    draft.arrays["sample_ns"][frame:, body] -= 5_000_000_000


@fault("unknown-frame", 49)
def unknown_frame(draft, body, frame):
    """Fifty poses in a frame of reference that nobody knows."""
    stamps = set(draft.arrays["stamp_ns"][frame : frame + 50].tolist())

    def renamed(content):
        message = FrameTransforms.FromString(content[MESSAGE.size :])
        for pose in message.transforms:
            if pose.child_frame_id == BODIES[body] and MESSAGE.unpack_from(content)[3] in stamps:
                pose.parent_frame_id = "attic"
        return content[: MESSAGE.size] + message.SerializeToString()

    draft.changes.append(lambda data: with_messages(data, renamed, POSE_CHANNEL))


@fault("mesh-mirrored", None)
def mirrored_mesh(draft, body, frame):
    """A mesh that is mirrored."""
    mesh = draft.meshes[BODIES[body]]
    draft.meshes[BODIES[body]] = MeshData(mesh.vertices * [-1.0, 1.0, 1.0], mesh.faces)


@fault("mesh-hash", None)
def wrong_hash(draft, body, frame):
    """A hash that is not that of the mesh."""
    stated = re.compile(rb"(mesh\.sha256/%s....)[0-9a-f]{64}" % BODIES[body].encode(), re.DOTALL)
    draft.changes.append(lambda data: stated.sub(rb"\g<1>" + b"0" * 64, data))


@fault("identity-while-lost", 19)
def identity_while_lost(draft, body, frame):
    """Twenty frames with the pose of the origin."""
    draft.arrays["position"][frame : frame + 20, body] = 0.0
    draft.arrays["quaternion_xyzw"][frame : frame + 20, body] = [0.0, 0.0, 0.0, 1.0]


@fault("out-of-space", 1)
def out_of_space(draft, body, frame):
    """Two positions far outside of the room."""
    draft.arrays["position"][frame : frame + 2, body, 0] = 1e200, -1001.0


FAULTS = {
    "nan position": nan_position, "zero quaternion": zero_quaternion, "non-unit quaternion": non_unit_quaternion,
    "time backwards": time_backwards, "duplicate stamps": duplicate_stamps, "1 s gap": gap, "frozen pose": frozen,
    "teleport": teleport(0.5), "millimetres": millimetres, "5 s skew of the log": log_skew,
    "5 s skew of a device": device_skew, "unknown frame": unknown_frame, "mirrored mesh": mirrored_mesh,
    "wrong hash": wrong_hash, "identity while lost": identity_while_lost, "out of space": out_of_space,
}  # fmt: skip
