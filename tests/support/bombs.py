"""Small files that ask for much, and what each verb spends on them.

``PYTHONPATH=.:tests python -m support.bombs FOLDER`` prints seconds of processor time and MB per bomb and verb.
"""

import json
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.opcode import Opcode
from support.hostile import _listed, _with_records, good_files
from support.hostile_files import MESSAGE, closed, text
from support.peak_memory import environment

VERBS = ("info", "doctor", "recover")
PLAIN_BYTES, BYTES_PER_BYTE = 100 << 20, 50
PLAIN_S, S_PER_MB = 2.0, 1.0


def _tf(head: tuple[int, int, int, int], payload: bytes = b"") -> tuple[int, bytes]:
    return Opcode.MESSAGE, MESSAGE.pack(*head) + payload


def _chunks(data: bytes, *messages: list[tuple[int, bytes]]) -> bytes:
    """A good file with chunks of its /tf channel, the first one, added."""
    more = [(Opcode.CHUNK, closed(one, 0, 2**62)) for one in messages]
    return _with_records(data, lambda parts: [*parts[:-1], *more, parts[-1]])


def _named(first: int, count: int) -> bytes:
    message = FrameTransforms()
    for k in range(first, first + count):
        one = message.transforms.add()
        one.parent_frame_id, one.child_frame_id, one.rotation.w = "world", f"n{k}", 1.0
    return message.SerializeToString()


def _many_names(data: bytes, count: int, each: int) -> bytes:
    parts = [_tf((1, k, k, k), _named(k * each, each)) for k in range(count // each)]
    return _chunks(data, *(parts[k : k + 50] for k in range(0, len(parts), 50)))


def _empty(data: bytes, chunks: int, count: int) -> bytes:
    return _chunks(data, *([_tf((1, 0, c * count + k, c * count + k)) for k in range(count)] for c in range(chunks)))


def _same(data: bytes, chunks: int, count: int) -> bytes:
    """Chunks that are packed to nothing: every message is the same."""
    return _chunks(data, *([[_tf((1, 0, 5, 5))] * count] * chunks))


def _scene(data: bytes, scene: bytes) -> bytes:
    content = (
        struct.pack("<QQ", 0, 0) + text("scene.toml") + text("x") + struct.pack("<Q", len(scene)) + scene + bytes(4)
    )
    return _with_records(data, lambda parts: [*parts[:-1], (Opcode.ATTACHMENT, content), parts[-1]])


def _bodies(count: int, more: str = "") -> bytes:
    """Bodies b0, b1, ..., each with a line more, of its number and the next."""
    lines = [f'[[body]]\nid="b{k}"\n{more.format(k, k + 1)}\n' for k in range(count)]
    return "".join(lines).replace(f'parent="b{count}"', "").encode()


def _added(data: bytes, records: list[tuple[int, bytes]]) -> bytes:
    return _with_records(data, lambda parts: [parts[0], *records, *parts[1:]])


def _backwards(data: bytes, count: int) -> bytes:
    stamps = [10**18 + (k // 2 if k % 2 else 10**9 + k) for k in range(count)]
    return _chunks(data, [_tf((1, k, stamp, stamp)) for k, stamp in enumerate(stamps)])


def _topics(data: bytes, count: int) -> bytes:
    channels = [
        (Opcode.CHANNEL, struct.pack("<HH", 100 + k, 1) + text(f"/hands/{k}/l") + text("protobuf") + bytes(4))
        for k in range(count)
    ]
    return _added(data, channels)


BOMBS: dict[str, Callable[[bytes], bytes]] = {
    "a million names": lambda data: _many_names(data, 1_000_000, 5000),
    "a million listed names": lambda data: _with_records(data, _listed([f"n{k}" for k in range(1_000_000)])),
    "4,000 names in 20,000 empty frames": lambda data: _empty(
        _with_records(data, _listed(["body 0", "body 1", *(f"n{k}" for k in range(4000))])), 1, 20_000
    ),
    "ten chunks that unpack to 60 MB each": lambda data: _same(data, 10, 2_000_000),
    "two million empty messages": lambda data: _same(data, 1, 2_000_000),
    "a scene of dots": lambda data: _scene(data, b"a" + b".a" * 200_000 + b"=1\n"),
    "a scene of nested arrays": lambda data: _scene(data, b"a=" + b"[" * 100_000),
    "a scene of tables": lambda data: _scene(data, b"[[body]]\n" * 100_000),
    "a scene of bodies": lambda data: _scene(data, _bodies(20_000)),
    "a scene of bodies of one name": lambda data: _scene(data, b'[[body]]\nid="a"\n' * 20_000),
    "a chain of parents": lambda data: _scene(data, _bodies(20_000, 'parent="b{1}"')),
    "bodies without their parents": lambda data: _scene(data, _bodies(20_000, 'parent="c{0}"')),
    "tags times tags": lambda data: _scene(
        data, _bodies(5000, 'tags=["x"]') + b'[[pair]]\nbetween=["tag:x", "tag:x"]\n' * 100
    ),
    "effects times bodies": lambda data: _scene(
        data, _bodies(5000, 'tags=["x"]') + b'[[effect]]\nkind="contact"\nbetween=["tag:x", "tag:x"]\n' * 5000
    ),
    "100,000 frames that jump back": lambda data: _backwards(data, 100_000),
    "60,000 topics": lambda data: _topics(data, 60_000),
    "a million tiny records": lambda data: _added(data, [(0x90, b"")] * 1_000_000),
    "ten thousand attachments": lambda data: _added(data, [
        (Opcode.ATTACHMENT, bytes(16) + text(f"a{k}") + text("") + bytes(8) + bytes(4)) for k in range(10_000)
    ]),
}  # fmt: skip
"""Name -> what it makes of a good file."""

SMALLER: dict[str, Callable[[bytes], bytes]] = {
    "a scene of dots": lambda data: _scene(data, b"a" + b".a" * 200_000 + b"=1\n"),
    "two million empty messages": lambda data: _same(data, 1, 150_000),
}
"""The same, quick to make."""

_PROGRAM = """
import json, sys, time
from pathlib import Path
from support.peak_memory import peak_bytes
from replay.session_info import session_info
from sessions import examine, read_session, recover
from sessions.errors import SessionError
path, verb = Path(sys.argv[1]), sys.argv[2]
work = {"info": lambda p: session_info(read_session(p)), "doctor": examine,
        "recover": lambda p: recover(p, p.with_suffix(".out"), overwrite=True)}[verb]
work(Path(sys.argv[3]))
plain, began, said = peak_bytes(), time.process_time(), "fine"
try:
    work(path)
except SessionError as error:
    said = str(error)
print(json.dumps({"seconds": time.process_time() - began, "bytes": peak_bytes() - plain, "said": said}))
"""


def spent(verb: str, path: Path, good: Path, limit_s: float = 120.0) -> dict:
    """Seconds of processor time and bytes beyond those of a good file that a verb takes, in a process of its own."""
    command = [sys.executable, "-c", _PROGRAM, str(path), verb, str(good)]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=limit_s, check=False)
    return (
        json.loads(done.stdout) if done.returncode == 0 else {"said": done.stderr[-500:], "seconds": 1e9, "bytes": 1e18}
    )


def within(size: int, found: dict) -> bool:
    """Whether a file of so many bytes cost no more than it may."""
    return found["seconds"] <= PLAIN_S + S_PER_MB * size / 1e6 and found["bytes"] <= PLAIN_BYTES + BYTES_PER_BYTE * size


def main(folder: Path) -> None:
    """Every bomb through every verb."""
    folder.mkdir(parents=True, exist_ok=True)
    good = good_files(folder)["own.mcap"]
    for name in sys.argv[2:] or BOMBS:
        path = folder / "bomb.mcap"
        path.write_bytes(BOMBS[name](good))
        size = path.stat().st_size
        for verb in VERBS:
            found = spent(verb, path, folder / "own.mcap")
            mark = "ok " if within(size, found) else "BAD"
            cost = f"{found['seconds']:6.1f} s {found['bytes'] / 1e6:8.0f} MB"
            print(f"{mark} {name:<38} {size / 1e6:6.2f} MB  {verb:<8} {cost}  {found['said'][:90]}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
