"""Mutants of good files, and what each reader makes of them: a result, a finding, a salvage or one named error.

``python tests/support/fuzzing.py FOLDER FIRST LAST`` tries these mutants; any number is one file for ever.
"""

import faulthandler
import json
import struct
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.damage import chunks, records, with_chunk
from support.mcap_samples import protobuf_messages, random_frames, session_of, tetrahedron, write_foreign
from support.peak_memory import peak_bytes

from sessions import Event, HandTrack, Interval, Recorder, examine, import_session, parse_scene, read_session, recover
from sessions.errors import SessionError
from sessions.mcap_format.writer import write_session

EXTREMES = [0, 1, 2**31 - 1, 2**32 - 1, 2**53, 2**63 - 1, 2**64 - 1]

SCENE = """
[scene]
name = "fuzzed"
[[body]]
id = "a"
shape = "box"
size = [0.1, 0.2, 0.3]
tags = ["glass"]
fixed = { position = [0.0, 0.9, 0.0] }
[[body]]
id = "b"
mesh = "b.glb"
[[ignore]]
between = ["a", "b"]
[[effect]]
kind = "contact"
between = ["b", "tag:glass"]
"""

CSV = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value\n" + "".join(
    f"pose,{0.011 * k:.6f},Cup{k % 2},{0.01 * k},1,0,0,0,0,1,1,,\n" for k in range(60)
)


def aframe() -> bytes:
    pose = {"position": {"x": 0.1, "y": 1.0, "z": 0.0}, "rotation": {"x": 0, "y": 0.5, "z": 0}}
    return json.dumps({name: {"poses": [{"timestamp": 11.0 * k, **pose} for k in range(30)]} for name in "ab"}).encode()


def seeds(folder: Path) -> dict[str, bytes]:
    """The good files, by a name whose suffix says what they are."""
    frames = random_frames(1, 60, 3, absent=0.1, odd=0.2)
    times = frames.stamp_ns
    hand = HandTrack(times, np.linspace(0, 1, 60), np.zeros(60), ("menu",), np.zeros((60, 1)))
    parts = {
        "meshes": {"body 1": tetrahedron()}, "events": [Event(int(times[3]), "grasp", "takes", "body 1")],
        "intervals": [Interval(int(times[0]), int(times[9]), "task", "stir")], "hands": {"student/right": hand},
        "scene": parse_scene('[[body]]\nid = "body 1"\n'),
    }  # fmt: skip
    write_session(session_of(frames, **parts), folder / "own.mcap")
    with Recorder(folder / "live.mcap", overwrite=True) as recorder:
        for k in range(40):
            recorder.poses(k * 300_000_000, {"a": ((0.1 * k, 0, 0), (0, 0, 0, 1)), "b": ((0, 1, 0), (0, 0, 0, 1))})
    messages = protobuf_messages(random_frames(2, 40, 2))
    write_foreign(folder / "foreign.mcap", messages, chunk_size=2000)
    from mcap.writer import CompressionType

    write_foreign(folder / "lz4.mcap", messages, chunk_size=2000, compression=CompressionType.LZ4)
    write_foreign(folder / "loose.mcap", messages, use_chunking=False)
    files = {path.name: path.read_bytes() for path in sorted(folder.glob("*.mcap"))}
    return files | {"session.csv": CSV.encode(), "session.json": aframe(), "scene.toml": SCENE.encode()}


def mutant(files: dict[str, bytes], number: int) -> tuple[str, bytes]:
    """A file's name and its changed bytes; a third are texts, and every second container has its checksum repaired."""
    random = np.random.default_rng([7, number])
    texts = [name for name in files if not name.endswith(".mcap")]
    containers = [name for name in files if name.endswith(".mcap")]
    name = texts[number // 3 % len(texts)] if number % 3 == 0 else containers[int(random.integers(len(containers)))]
    data = files[name]
    if name in ("own.mcap", "live.mcap", "foreign.mcap") and number % 2:
        places = range(len(chunks(data)))
        return name, with_chunk(data, int(random.choice(places)), lambda plain: mutated(plain, random))
    return name, mutated(data, random)


def mutated(data: bytes, random: np.random.Generator) -> bytes:
    """One to four changes, one after the other."""
    for _ in range(int(random.integers(1, 5))):
        if not data:
            return data
        data = CHANGES[int(random.integers(len(CHANGES)))](data, random)
    return data


def _span(data: bytes, random: np.random.Generator) -> tuple[int, int]:
    start = int(random.integers(len(data)))
    return start, min(len(data), start + int(random.integers(1, 200)))


def _flip(data: bytes, random: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for at in random.integers(0, len(data), int(random.integers(1, 30))).tolist():
        changed[at] ^= 1 << int(random.integers(8))
    return bytes(changed)


def _cut(data: bytes, random: np.random.Generator) -> bytes:
    return data[: int(random.integers(len(data)))]


def _remove(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:start] + data[end:]


def _repeat(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:end] + data[start:end] * int(random.integers(1, 20)) + data[end:]


def _noise(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:start] + random.bytes(end - start) + data[end:]


def _extreme(data: bytes, random: np.random.Generator) -> bytes:
    """A number of four or eight bytes somewhere becomes one that no file means."""
    kind = "<I" if random.random() < 0.5 else "<Q"
    size = struct.calcsize(kind)
    at = int(random.integers(max(1, len(data) - size)))
    if random.random() < 0.5 and data[:5] == b"\x89MCAP":
        starts = [start + 1 for _, start, _ in records(data)] or [at]
        at, kind, size = int(random.choice(starts)), "<Q", 8
    value = EXTREMES[int(random.integers(len(EXTREMES)))] & ((1 << 8 * size) - 1)
    return data[:at] + struct.pack(kind, value) + data[at + size :]


CHANGES = [_flip, _flip, _cut, _remove, _repeat, _noise, _extreme]


def outcomes(name: str, data: bytes, folder: Path) -> list[str]:
    """What every reader makes of a file; anything but a result or a `SessionError` is raised."""
    path = folder / name
    path.write_bytes(data)
    if name.endswith(".toml"):
        return [
            _told("scene", lambda: parse_scene(data.decode("utf-8", "replace"))),
            _told("doctor", lambda: examine(path)),
        ]
    if name.endswith(".csv"):
        return [_told("csv", lambda: _all(import_session("csv", path, convention="unity")))]
    if name.endswith(".json"):
        return [_told("aframe", lambda: _all(import_session("aframe", path)))]
    out = folder / "out.mcap"
    out.unlink(missing_ok=True)
    found = [_told("read", lambda: _all(read_session(path, torn="keep"))), _told("doctor", lambda: examine(path))]
    found.append(_told("recover", lambda: recover(path, out)))
    if found[-1] == "recover: fine":
        found.append(_told("recovered", lambda: _all(read_session(out))))
    return found


def _told(who: str, work) -> str:
    try:
        work()
    except SessionError as error:
        assert str(error).strip() and "\n" not in str(error), repr(str(error))
        return f"{who}: {type(error).__name__}"
    return f"{who}: fine"


def _all(session) -> None:
    """Everything a session offers, decoded."""
    for _ in session.blocks(4096):
        pass
    list(session.live_contacts)
    for mapping in (session.hands, session.fast_tracks, session.gaze, session.scalars, session.meshes):
        dict(mapping.items())


def main(folder: Path, first: int, last: int) -> None:
    """Try mutants, saying the number of each before it; at the end how each reader fared."""
    faulthandler.enable()
    (folder / "seeds").mkdir(parents=True, exist_ok=True)
    files = seeds(folder / "seeds")
    count: Counter[str] = Counter()
    for number in range(first, last):
        print(number, flush=True)
        name, data = mutant(files, number)
        count.update(outcomes(name, data, folder))
    told = {"outcomes": dict(count), "peak_mib": peak_bytes() / 2**20}
    print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
