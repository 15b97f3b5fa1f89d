"""Makes the guide's page *Real recordings*: public recordings of VR hardware, audited with stated meshes.

python .ci/real_recordings.py fetch FOLDER            prints the commands that put the recordings into FOLDER
python .ci/real_recordings.py page FOLDER             prints the page, with what FOLDER and ../shared/data hold
"""

import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

import replay
from replay.outputs.run_tables import ranking_table
from replay.outputs.tables import text_of
from sessions import Session, Severity, examine, import_session
from sessions.glassware.devices import proxy_headset

ROOT = Path(__file__).resolve().parents[1]
TEXT = Path(__file__).with_name("real_recordings.md")

LINEUP = {
    "hull50": "collider[shape=hull,rate_hz=50]", "mesh50": "collider[shape=mesh,rate_hz=50]", "paper": "hybrid-qaco",
}  # fmt: skip

WAND = "htc-vive-none.glb"
HEADSET_FACES = 2000
CUBE_M = 0.1
TABLE_M = (0.6, 0.02, 0.6)


@dataclass(frozen=True)
class Recording:
    """A public recording: where it comes from, what made it, and where a copy lies that tests use."""

    name: str
    repository: str
    commit: str
    path: str
    licence: str
    device: str
    shared: str = ""

    @property
    def file(self) -> str:
        """Name of the copy that ``fetch`` makes."""
        return f"{self.name}{Path(self.path).suffix}"

    def find(self, folder: Path | None) -> Path | None:
        """The copy in a folder or beside the checkout; ``None``: there is none."""
        places = [folder / self.file] if folder is not None else []
        places += [ROOT.parent / "shared" / "data" / self.shared] if self.shared else []
        return next((place for place in places if place.is_file()), None)


AFRAME, MIT = "headset and two tracked controllers, WebVR (A-Frame)", "MIT"
CAPTURES = ("dmarcos/aframe-motion-capture-components", "3a3cbd73ffc751285be95e9729a09121ff03c440")
EARLIER = (CAPTURES[0], "2178e521b64f9a06bc924501078ce56f9532cc05")
DANCE = ("aframevr/a-saturday-night", "97dda30c790709a1178dfa3c2278a054411f52cc")
ACCURACY = ("MarvinGravert/Vive-Accuracy-Experiment", "fc5249003f969423f0bff3053be54ade2df5519a")
TRACKER = "HTC VIVE tracker at rest (OpenVR)"

RECORDINGS = (
    Recording("grab-left", *CAPTURES, "examples/recordings/grabLeft.json", MIT, AFRAME,
              "aframe-motion-capture/grabLeft.json"),
    Recording("grab-right", *CAPTURES, "examples/recordings/grabRight.json", MIT, AFRAME,
              "aframe-motion-capture/grabRight.json"),
    Recording("tracked", *CAPTURES, "examples/assets/tracked-recording.json", MIT, AFRAME,
              "aframe-motion-capture/tracked-recording.json"),
    Recording("dev", *CAPTURES, "examples/assets/dev-recording.json", MIT, AFRAME),
    Recording("player-2017", *EARLIER, "examples/assets/player-recording.json", MIT, AFRAME),
    Recording("dance", *DANCE, "assets/dance.json", "MIT, by its package.json", AFRAME, "a-saturday-night/dance.json"),
    Recording("tracker-august", *ACCURACY, "Experiment_Data/20200820_Exp1/measurementPoint3.txt", MIT, TRACKER,
              "vive-accuracy/measurementPoint3.txt"),
    Recording("tracker-july", *ACCURACY, "Experiment_Data/20200717_Exp2/measurementPoint1.txt", MIT, TRACKER),
    Recording("tracker-september", *ACCURACY, "Experiment_Data/20200917_Exp2/measurementPoint10.txt", MIT, TRACKER),
)  # fmt: skip

HEAD = (
    "recording", "rate, length", "doctor", "contacts", "hulls at 50 Hz", "meshes at 50 Hz", "paper", "`exact` a frame",
    "took",
)  # fmt: skip
TIMES = 2
"""The last columns, which differ from machine to machine."""


def wand(folder: Path | None) -> Path:
    """The mesh of a VIVE wand, from a folder or beside the checkout."""
    places = [] if folder is None else [folder / WAND]
    places.append(ROOT.parent / "shared" / "data" / "webxr-vive-controller" / WAND)
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        sys.exit(f"{WAND} is not there; `fetch` prints the command that gets it")
    return found


def imported(file: Path, folder: Path | None) -> Session:
    """The session of a recording, with meshes: both controllers are VIVE wands, the headset is the tool's own."""
    if file.suffix == ".txt":
        return cube_on_table(file)
    mesh = wand(folder)
    plain = import_session("aframe", file)
    meshes = {name: mesh for name in plain.names if name != "camera"}
    headset = proxy_headset(HEADSET_FACES).mesh
    session = import_session("aframe", file, meshes=meshes)
    return replace(session, meshes={**session.meshes, "camera": headset})


def cube_on_table(file: Path) -> Session:
    """A cube on the tracker and a table just below it: they touch in the middle one of all its poses."""
    rows = np.loadtxt(file)
    positions, quaternions = rows[:, :3], rows[:, [4, 5, 6, 3]]
    seen = np.any(positions != 0.0, axis=1)
    cube = trimesh.creation.box((CUBE_M, CUBE_M, CUBE_M))
    turns = Rotation.from_quat(quaternions[seen]).as_matrix()
    lowest = (turns @ cube.vertices.T)[:, 1].min(axis=1) + positions[seen, 1]
    table = trimesh.creation.box(TABLE_M)
    x, _, z = np.median(positions[seen], axis=0)
    place = np.tile([x, float(np.median(lowest)) - TABLE_M[1] / 2, z], (len(rows), 1))
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (len(rows), 1))
    times_ns = np.arange(len(rows)) * 4_000_000  # 250 Hz by its first line; its rows have no stamps
    poses = {"cube": (positions, quaternions), "table": (place, upright)}
    meshes = {"cube": (cube.vertices, cube.faces), "table": (table.vertices, table.faces)}
    return Session.from_arrays(times_ns, poses, meshes=meshes)


def row(recording: Recording, file: Path, folder: Path | None) -> list[str]:
    """What the page says of a recording, below ``HEAD``."""
    begun = time.perf_counter()
    session = imported(file, folder)
    steps = np.diff(session.frames.stamp_ns) / 1e9
    findings = Counter(one.code for one in examine(session) if one.severity > Severity.NOTE)
    result = replay.run(session, detectors=LINEUP, oracle="exact")
    table = ranking_table(result)
    names = [column.name for column in table.columns]
    ranks = {text_of(cells[0]): dict(zip(names, map(text_of, cells), strict=True)) for cells in table.rows}
    contacts = len(result.episodes["exact"])
    said = [_said(ranks[label], contacts) for label in LINEUP]
    mean = f"{ranks['exact']['mean ms']} ms"
    length = f"{1 / np.median(steps):.0f} Hz, {len(steps) + 1:,} frames, {steps.sum():.0f} s"
    doctor = ", ".join(f"{code} {count}" if count > 1 else code for code, count in sorted(findings.items()))
    took = f"{time.perf_counter() - begun:.1f} s"
    return [recording.name, length, doctor or "nothing", str(contacts), *said, mean, took]


def _said(rank: dict[str, str], contacts: int) -> str:
    """Missed, late or cut short, and what share of what it reports is false."""
    lost = f"missed {rank['missed']}, late {rank['late or cut short']}" if contacts else "-"
    return f"{lost}; {rank['false contact']} false"


def rows(folder: Path | None) -> Iterator[list[str]]:
    """A row for each recording that is there."""
    for recording in RECORDINGS:
        file = recording.find(folder)
        if file is not None:
            yield row(recording, file, folder)


def page(folder: Path | None) -> str:
    """The page: the text beside this module, with the tables and figures in the places for them."""
    measured = list(rows(folder))
    sources = ["| recording | device | repository, file, commit | licence |", "|---|---|---|---|"]
    for one in RECORDINGS:
        where = f"[{one.repository}](https://github.com/{one.repository}), `{Path(one.path).name}`, {one.commit[:7]}"
        sources.append(f"| {one.name} | {one.device} | {where} | {one.licence} |")
    table = [HEAD, ["---"] * len(HEAD), *measured]
    text = TEXT.read_text("utf-8")
    text = text.replace("{measured}", "\n".join(f"| {' | '.join(cells)} |" for cells in table))
    text = text.replace("{sources}", "\n".join(sources))
    for cells in measured:
        for heading, cell in zip(HEAD, cells, strict=True):
            text = text.replace(f"{{{cells[0]}: {heading}}}", cell)
    return text


def fetch_commands(folder: Path) -> Iterator[str]:
    """Shell commands that put every recording, and the mesh of the wand, into a folder."""
    yield f"mkdir -p {folder}"
    for repository in dict.fromkeys(one.repository for one in RECORDINGS):
        clone = repository.rpartition("/")[2]
        yield f"git clone https://github.com/{repository} {folder}/{clone}"
        for one in RECORDINGS:
            if one.repository == repository:
                yield f"git -C {folder}/{clone} show {one.commit}:{one.path} > {folder}/{one.file}"
    yield f"npm pack @webxr-input-profiles/assets@1.0.20 --pack-destination {folder}"
    inside = "package/dist/profiles/htc-vive/none.glb"
    yield f"tar -xzOf {folder}/webxr-input-profiles-assets-1.0.20.tgz {inside} > {folder}/{WAND}"


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in ("fetch", "page"):
        sys.exit(__doc__)
    target = Path(sys.argv[2])
    print("\n".join(fetch_commands(target)) if sys.argv[1] == "fetch" else page(target).rstrip("\n"))
