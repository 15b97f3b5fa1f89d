"""Measures `replay fix -v` on a session of ten bodies of 5,000 faces: seconds of wall, memory, report cards.

python .ci/ten_bodies.py FOLDER                 writes FOLDER/session.mcap and runs the command on it
python .ci/ten_bodies.py FOLDER --time-limit 30 gives the command these options too

Five vessels stand in a row. Two hands, tongs, a pipette and a thermometer probe go from vessel to vessel, down into
each until they touch, and up again. Pieces are cut anew: the command gets an empty cache of pieces.
"""

import json
import os
import resource
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Final

import numpy as np

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.protocol import counts_as_contact
from sessions import MeshData, Session, write_session
from sessions.glassware.catalogue import make_instrument
from sessions.synthetic.choreography import Script
from sessions.synthetic.rng import random_stream

FACES: Final = 5000
VESSELS: Final = ("beaker_250", "erlenmeyer_flask", "evaporating_dish", "funnel", "test_tube_rack")
MOVERS: Final = ("hand_left", "hand_right", "tongs", "pipette", "tripod")

APART: Final = 0.35
"""Metres between two vessels."""

HIGH: Final = 0.45
"""Metres above the table at which a mover waits."""

DEPTH: Final = 0.0004
"""Metres by which a touch goes into the surface."""

STEP: Final = 0.0005
"""Metres between two positions at which a touch is searched on the way down."""

ASIDE: Final = 0.02
"""Metres from the middle of a vessel at which a mover goes down, at most."""

SLOT: Final = 10.0
"""Seconds that a mover has for a vessel."""

RATE_HZ: Final = 90.0
LONGEST: Final = 60.0
MOST_BYTES: Final = 2**30


def first_touch(vessel: TriangleMesh, mover: TriangleMesh, aside: tuple[float, float]) -> float:
    """Height of a mover above the table at which it touches a vessel first, on its way down."""
    heights = np.arange(HIGH, -0.1, -STEP)
    translations = np.zeros((len(heights), 2, 3))
    translations[:, 1, 0], translations[:, 1, 2] = aside
    translations[:, 1, 1] = heights
    rotations = np.tile(np.eye(3), (len(heights), 2, 1, 1))
    motion = Motion(np.arange(len(heights)) / RATE_HZ, translations, rotations)
    detection = create_detector("exact", [Body("vessel", vessel), Body("mover", mover)]).detect(motion)
    touches = np.flatnonzero(counts_as_contact(detection.verdict)[:, 0])
    return float(heights[touches[0]]) if len(touches) else 0.05


def standing(mesh: MeshData) -> MeshData:
    """The mesh with its lowest point at the height 0, its middle above the origin."""
    low, high = np.asarray(mesh.bounds)
    middle = (low + high) / 2
    return MeshData(mesh.vertices - [middle[0], low[1], middle[2]], mesh.faces)


def session_of_ten(seed: int = 0) -> Session:
    """The session: each mover visits each vessel once."""
    meshes = {name: standing(make_instrument(name, FACES).mesh) for name in (*VESSELS, *MOVERS)}
    cores = {name: TriangleMesh(mesh.vertices, mesh.faces) for name, mesh in meshes.items()}
    rng = random_stream(seed, "ten-bodies")
    scripts = {name: Script((APART * k, HIGH, 0.0)) for k, name in enumerate(MOVERS)}
    for slot in range(len(VESSELS)):
        for number, mover in enumerate(MOVERS):
            place = (number + slot) % len(VESSELS)
            dx, dz = rng.uniform(-ASIDE, ASIDE, 2)
            script, x = scripts[mover], APART * place + dx
            touch = first_touch(cores[VESSELS[place]], cores[mover], (dx, dz))
            script.wait_until(SLOT * slot)
            # Movers that change places pass behind each other.
            script.go((script.position[0], HIGH, 0.4 + 0.3 * number), 0.8)
            script.go((x, HIGH, 0.4 + 0.3 * number), 1.0)
            script.go((x, HIGH, dz), 0.8)
            script.go((x, touch + 0.004, dz), 1.5)
            for depth in (DEPTH, 2 * DEPTH, -0.002, DEPTH):
                script.go((x, touch - depth, dz), 0.5)
            script.wait(0.4)
            script.go((x, HIGH, dz), 1.2)
    stamps = np.arange(round(SLOT * len(VESSELS) * RATE_HZ)) * round(1e9 / RATE_HZ)
    times = stamps * 1e-9
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    poses = {name: (np.tile([APART * k, 0.0, 0.0], (len(times), 1)), still) for k, name in enumerate(VESSELS)}
    for name, script in scripts.items():
        poses[name] = script.path(random_stream(seed, "ten-bodies", name))(times)
    return Session.from_arrays(stamps, poses, meshes)


def memory_of_tree(process: int) -> int:
    """Bytes in memory of a process and of all that it began."""
    waiting, total = [process], 0
    while waiting:
        number = waiting.pop()
        try:
            status = Path(f"/proc/{number}/statm").read_text()
            waiting += [
                int(child)
                for task in Path(f"/proc/{number}/task").iterdir()
                for child in (task / "children").read_text().split()
            ]
        except OSError:
            continue
        total += int(status.split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return total


def main(folder: str, *options: str) -> int:
    """Print the seconds, the memory, and the report cards a method; 1: too slow, too large, or cards are missing."""
    target = Path(folder).resolve()
    target.mkdir(parents=True, exist_ok=True)
    file = target / "session.mcap"
    if not file.is_file():
        write_session(session_of_ten(), file)
    cache = target / f"cache-{time.time_ns()}"
    command = [sys.executable, "-m", "replay", "fix", str(file), "-o", str(target / "fix"), "--force", "-v", *options]
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    began, most = time.monotonic(), 0
    with (target / "screen.txt").open("w") as screen:
        child = subprocess.Popen(command, env=environment, stdout=screen, stderr=subprocess.STDOUT)
        while child.poll() is None:
            most = max(most, memory_of_tree(child.pid))
            time.sleep(0.05)
    seconds = time.monotonic() - began
    bodies = json.loads((target / "fix" / "colliders.json").read_text())["bodies"]
    cards = Counter(card["how"].split(",")[0] for row in bodies for card in row["others"])
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = used.ru_utime + used.ru_stime
    print(f"{seconds:.1f} s, {processor:.1f} s of processor time, {most / 2**20:.0f} MiB, exit code {child.returncode}")
    print("cards beside hulls and advice:")
    for how, count in cards.items():
        print(f"  {how}: {count}")
    return int(seconds > LONGEST or most > MOST_BYTES or not any("V-HACD" in how for how in cards))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
