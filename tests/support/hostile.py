"""What `info`, `doctor`, `run` and `recover` say of one file, and what of it cannot all be true.

``python -m support.hostile FOLDER FIRST LAST`` tries these mutants and ends in a line of JSON.
"""

import json
import struct
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode
from mcap.writer import CompressionType
from support.damage import CHUNK, HEAD
from support.hostile_files import MESSAGE, closed, crafted, joined, opened, split, table, text
from support.mcap_samples import protobuf_messages, session_of, tetrahedron, write_foreign

from cdcore.errors import CollisionCoreError
from replay.errors import ReplayError
from replay.pipeline.engine import compute
from replay.session_info import session_info
from sessions import (
    Event,
    Frames,
    GazeTrack,
    HandTrack,
    Interval,
    LiveContact,
    Recorder,
    ScalarTrack,
    Severity,
    Track,
    examine,
    parse_scene,
    read_session,
    recover,
    write_session,
)  # fmt: skip
from sessions.errors import SessionError


def frames(count: int = 300) -> Frames:
    """Two bodies at 90 Hz that no doctor finds anything wrong with."""
    rng = np.random.default_rng(4)
    stamp = 1_700_000_000_000_000_000 + np.arange(count) * 11_111_111
    shape = (count, 2)
    position = 0.2 * np.sin(np.linspace(0, 9, count))[:, None, None] + rng.normal(0, 1e-4, (*shape, 3))
    position[:, 1, 0] += 1.0
    quaternion = np.array([0, 0, 0, 1]) + rng.normal(0, 1e-4, (*shape, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    sample, status = np.repeat(stamp[:, None], 2, axis=1), np.ones(shape, dtype=np.uint8)
    return Frames(("body 0", "body 1"), stamp, stamp + 700, sample, position, quaternion, status)


def good_files(folder: Path) -> dict[str, bytes]:
    """The files that mutants are made of; the doctor finds no error in those of our own profile."""
    made = frames()
    t = made.stamp_ns
    parts = {
        "meshes": {"body 0": tetrahedron(0.2), "body 1": tetrahedron(0.3)},
        "events": [Event(int(t[3]), "grasp", "takes", "body 1")],
        "intervals": [Interval(int(t[0]), int(t[9]), "task", "stir")],
        "hands": {
            "student/right": HandTrack(t[:60], np.linspace(0, 1, 60), np.zeros(60), ("menu",), np.zeros((60, 1)))
        },
        "live_contacts": [LiveContact(int(t[4]), "body 0", "body 1", "enter")],
        "fast_tracks": {"body 1": Track(t[:50], made.position[:50, 1], made.quaternion_xyzw[:50, 1])},
        "gaze": {"student": GazeTrack(t[:50], made.position[:50, 0], np.tile([0.0, 0.0, -1.0], (50, 1)))},
        "scalars": {"heart rate": ScalarTrack(t[:50], np.linspace(70, 80, 50), "1/min")},
        "scene": parse_scene('[[body]]\nid = "body 1"\n[[body]]\nid = "body 0"\n'),
    }
    write_session(session_of(made, **parts), folder / "own.mcap")
    with Recorder(folder / "live.mcap", meshes=parts["meshes"], overwrite=True) as recorder:
        for k in range(40):
            pose = {name: (made.position[k, c], made.quaternion_xyzw[k, c]) for c, name in enumerate(made.names)}
            recorder.poses(int(t[k]), pose, log_ns=int(t[k]))
    messages = protobuf_messages(made)[:60]
    write_foreign(folder / "foreign.mcap", messages, chunk_size=4000)
    write_foreign(folder / "lz4.mcap", messages, chunk_size=4000, compression=CompressionType.LZ4)
    write_foreign(folder / "loose.mcap", messages, use_chunking=False)
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.mcap"))}


# --- Cases that people met ---


def _index_at(data: bytes, start: int) -> bytes:
    return data[:-28] + struct.pack("<Q", start) + data[-20:]


def _with_records(data: bytes, change) -> bytes:
    foot = int.from_bytes(data[-28:-20], "little") or len(data) - 37
    footer = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQI", 0, 0, 0)
    return data[:8] + joined(change(split(data[8:foot]))) + footer + data[:8]


def _with_messages(data: bytes, change, number: int = -1) -> bytes:
    """A file with the messages of one of its chunks changed."""

    def inside(parts):
        k = [k for k, (opcode, _) in enumerate(parts) if opcode == Opcode.CHUNK][number]
        first, last = CHUNK.unpack_from(parts[k][1])[:2]
        return [*parts[:k], (Opcode.CHUNK, closed(change(opened(parts[k][1])), first, last)), *parts[k + 1 :]]

    return _with_records(data, inside)


def _listed(names: list[str]):
    record = (Opcode.METADATA, text("vrlab.bodies") + table({"names": json.dumps(names)}))
    return lambda parts: [*parts[:-1], record, parts[-1]]


def _head(at: int, value: int):
    def change(parts):
        head = list(MESSAGE.unpack_from(parts[0][1]))
        head[at] = value
        return [(Opcode.MESSAGE, MESSAGE.pack(*head) + parts[0][1][MESSAGE.size :]), *parts[1:]]

    return change


MET: dict[str, Callable[[bytes], bytes]] = {
    "a body twice in a message": lambda data: _with_messages(
        data, lambda parts: [(opcode, content + content[MESSAGE.size :]) for opcode, content in parts]
    ),
    "more than 4,096 listed bodies": lambda data: _with_records(data, _listed([f"n{k}" for k in range(4097)])),
    "one body listed twice": lambda data: _with_records(data, _listed(["body 0", "body 0"])),
    "a body that is not listed": lambda data: _with_records(data, _listed(["body 0"])),
    "poses in JSON": lambda data: data.replace(b"/tf\x08\x00\x00\x00protobuf", b"/tf\x08\x00\x00\x00json\0\0\0\0"),
    "a log time of 2^63": lambda data: _with_messages(data, _head(2, 2**63)),
    "a frame time of 2^64 - 1": lambda data: _with_messages(data, _head(3, 2**64 - 1)),
    "an index at byte 2^63": lambda data: _index_at(data, 2**63),
    "an index at byte 7": lambda data: _index_at(data, 7),
    "an event that is none": lambda data: _with_messages(
        data, lambda parts: [(opcode, content[: MESSAGE.size] + b"\xff") for opcode, content in parts], 1
    ),
    "an unknown version": lambda data: data.replace(b"vrlab/1", b"vrlab/9"),
    "a damaged mark": lambda data: b"\x88" + data[1:],
    "no mark": lambda data: b"PK\x03\x04" + bytes(40),
}  # fmt: skip
"""Case -> what it makes of a good file."""


# --- What the verbs say ---

KNOWN = (SessionError, ReplayError, CollisionCoreError)


def _said(work) -> tuple[bool, str]:
    try:
        return True, str(work() or "")
    except KNOWN as error:
        assert str(error).strip() and str(error).isprintable(), repr(str(error))
        return False, str(error)


def verbs(path: Path, out: Path) -> dict[str, tuple[bool, str]]:
    """Whether each verb accepts a file, and what it says; ``doctor`` accepts where it finds no error."""
    found = {}
    findings = examine(path)
    wrong = [one for one in findings if one.severity == Severity.ERROR]
    found["doctor"] = (not wrong, "; ".join(f"{one.code}: {one.message}" for one in wrong))
    found["info"] = _said(lambda: session_info(read_session(path)) and "")
    found["run"] = _said(lambda: compute(read_session(path), detectors=()) and "")
    out.unlink(missing_ok=True)
    kept = []
    found["recover"] = _said(lambda: kept.append(recover(path, out)) or "")
    if kept:
        found["recover"] = (True, "; ".join(kept[0].sentences()))
        found["whole"] = (kept[0].whole, "")
        found["again"] = _said(lambda: session_info(read_session(out)) and "")
        structure = {"torn", "unreadable", "damaged-chunk", "bad-message", "data-crc"}
        left = [one for one in examine(out) if one.code in structure]
        found["healed"] = (not left, "; ".join(f"{one.code}: {one.message}" for one in left))
    else:
        assert not out.exists()
    return found


CONTRADICTIONS: dict[str, Callable[[dict[str, bool], dict[str, str]], bool]] = {
    "the doctor passes what info refuses": lambda yes, _: yes["doctor"] and not yes["info"],
    "the doctor passes what run refuses": lambda yes, _: yes["doctor"] and not yes["run"],
    "run accepts what info refuses": lambda yes, _: yes["run"] and not yes["info"],
    "info refuses what recover wrote": lambda yes, _: not yes.get("again", True),
    "the doctor sends what recover wrote to recover": lambda yes, _: not yes.get("healed", True),
    "nothing was lost or mended of a file that info refuses": lambda yes, said: (
        yes.get("whole", False) and not yes["info"] and "mended" not in said["recover"]
    ),
    "recover saves nothing of a file that info reads": lambda yes, _: yes["info"] and not yes["recover"],
    "the doctor sees no MCAP, recover saves some": lambda yes, said: "not-mcap" in said["doctor"] and yes["recover"],
}


def contradictions(found: dict[str, tuple[bool, str]]) -> list[str]:
    """What two verbs say that cannot both be true."""
    yes = {verb: accepted for verb, (accepted, _) in found.items()}
    said = {verb: words for verb, (_, words) in found.items()}
    return [words for words, wrong in CONTRADICTIONS.items() if wrong(yes, said)]


def tried(folder: Path, first: int, last: int, say: Callable[[int], None] = lambda _: None) -> dict:
    """Try mutants: how many there were, what each verb made of them, and what was wrong with them."""
    (folder / "seeds").mkdir(parents=True, exist_ok=True)
    files, work = good_files(folder / "seeds"), folder / "work"
    count, bad = Counter(), []
    work.mkdir(exist_ok=True)
    path, out = work / "mutant.mcap", work / "out.mcap"
    for number in range(first, last):
        say(number)
        path.write_bytes(crafted(files, number))
        began = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                found = verbs(path, out)
        except Exception:
            bad.append([number, "traceback", traceback.format_exc()[-1500:]])
            continue
        count.update(f"{verb} {'accepts' if accepted else 'refuses'}" for verb, (accepted, _) in found.items())
        bad += [[number, words, {verb: said for verb, (_, said) in found.items()}] for words in contradictions(found)]
        if time.process_time() - began > 4 * (2 + path.stat().st_size / 1e6):
            bad.append([number, "slow", time.process_time() - began])
        bad += [[number, "foreign file", one.name] for one in work.iterdir() if one not in (path, out)]
    return {"mutants": last - first, "outcomes": dict(sorted(count.items())), "wrong": bad}


if __name__ == "__main__":
    print(json.dumps(tried(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), say=lambda k: print(k, flush=True))))
