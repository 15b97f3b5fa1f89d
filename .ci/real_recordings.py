"""Makes a section of the guide's page *Results*: public recordings of VR hardware, audited with stated meshes.

python .ci/real_recordings.py fetch FOLDER            prints the commands that put the recordings into FOLDER
python .ci/real_recordings.py page FOLDER             writes the section, with what FOLDER and ../shared/data hold
python .ci/real_recordings.py class FOLDER            runs the sessions of twelve participants, and writes their page
python .ci/real_recordings.py pictures FOLDER         draws the pictures of the findings into .github/pictures
"""

import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh
from choosing import with_table
from scipy.spatial.transform import Rotation

import replay
from replay.cli.main import main
from replay.document.tables import text_of
from replay.guide.pages import PAGES_FOLDER
from replay.show.run_tables import ranking_table
from sessions import Session, Severity, examine, import_session, write_session
from sessions.glassware.devices import proxy_headset

ROOT = Path(__file__).resolve().parents[1]
TEXT = Path(__file__).with_name("real_recordings.md")
BEGIN = "<!-- begin of the section that real_recordings.py makes -->"
END = "<!-- end of the section that real_recordings.py makes -->"

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
        files = [folder / self.file] if folder is not None else []
        files += [ROOT.parent / "shared" / "data" / self.shared] if self.shared else []
        return next((place for place in files if place.is_file()), None)


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

SHOTS = ROOT / ".github" / "pictures"

PICTURES = {"grab-left": 730, "tracker-july": 765}
"""Recordings whose report is shown, and how many pixels of it."""

CLASS_REPOSITORY = "jsantospaz/uspceu_crom_vr_assessment"
CLASS_COMMIT = "acd0c08"
CLASS_FILES = {
    "P08": (30, 32), "P13": (50, 52), "P14": (54, 56), "P15": (58, 60), "P18": (70, 72), "P21": (82, 84),
    "P22": (86, 88), "P24": (94, 96), "P26": (102, 104), "P28": (110, 112), "P29": (114, 116), "P31": (122, 124),
}  # fmt: skip
"""Participant -> the numbers of two files that are read whole; in others a decimal comma stands between the cells."""

CLASS_MAPPING = """
convention = "unity"
units = "m"
[time]
column = "Time"
unit = "text"
format = "%H:%M:%S.%f"
[body]
name = "Device"
position = ["X", "Y", "Z"]
quaternion_xyzw = ["qX", "qY", "qZ", "qW"]
"""

POST_M = (0.02, 0.4, 0.02)
POST_GAP_M = 0.05
"""Between a post and the headset while its wearer looks straight ahead."""

REST_FRAMES = 200
"""At the start of a recording its wearer sits still; so many frames say where."""

HEAD = (
    "recording", "rate, length", "doctor", "contacts", "hulls at 50 Hz", "meshes at 50 Hz", "paper", "`exact` a frame",
    "took",
)  # fmt: skip
TIMES = 2
"""The last columns, which differ from machine to machine."""


def wand(folder: Path | None) -> Path:
    """The mesh of a VIVE wand, from a folder or beside the checkout."""
    files = [] if folder is None else [folder / WAND]
    files.append(ROOT.parent / "shared" / "data" / "webxr-vive-controller" / WAND)
    result = next((place for place in files if place.is_file()), None)
    if result is None:
        sys.exit(f"{WAND} is not there; `fetch` prints the command that gets it")
    return result


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
    visited = np.any(positions != 0.0, axis=1)
    cube = trimesh.creation.box((CUBE_M, CUBE_M, CUBE_M))
    rotations = Rotation.from_quat(quaternions[visited]).as_matrix()
    lowest = (rotations @ cube.vertices.T)[:, 1].min(axis=1) + positions[visited, 1]
    table = trimesh.creation.box(TABLE_M)
    x, _, z = np.median(positions[visited], axis=0)
    position = np.tile([x, float(np.median(lowest)) - TABLE_M[1] / 2, z], (len(rows), 1))
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (len(rows), 1))
    times_ns = np.arange(len(rows)) * 4_000_000  # 250 Hz by its first line; its rows have no stamps
    poses = {"cube": (positions, quaternions), "table": (position, upright)}
    meshes = {"cube": (cube.vertices, cube.faces), "table": (table.vertices, table.faces)}
    return Session.from_arrays(times_ns, poses, meshes=meshes)


def row(recording: Recording, file: Path, folder: Path | None) -> list[str]:
    """What the page says of a recording, below ``HEAD``."""
    begun = time.perf_counter()
    session = imported(file, folder)
    steps = np.diff(session.frames.stamp_ns) / 1e9
    findings = Counter(item.code for item in examine(session) if item.severity > Severity.NOTE)
    result = replay.run(session, detectors=LINEUP, oracle="exact")
    table = ranking_table(result)
    ranks = {text_of(cells[0]): dict(zip(table.head, map(text_of, cells), strict=True)) for cells in table.cells()}
    contacts = len(result.episodes["exact"])
    reported = [_said(ranks[label], contacts) for label in LINEUP]
    mean = f"{ranks['exact']['mean ms']} ms"
    length = f"{1 / np.median(steps):.0f} Hz, {len(steps) + 1:,} frames, {steps.sum():.0f} s"
    doctor = ", ".join(f"{code} {count}" if count > 1 else code for code, count in sorted(findings.items()))
    took = f"{time.perf_counter() - begun:.1f} s"
    return [recording.name, length, doctor or "nothing", str(contacts), *reported, mean, took]


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


def participant_session(file: Path, participant: str, mapping: Path) -> Session:
    """The headset of a participant between two posts that stand beside it as it rests."""
    headset = import_session("csv", file, mapping=mapping).tracks["H"]
    mesh = proxy_headset(HEADSET_FACES).mesh
    rotation = Rotation.from_quat(headset.quaternions_xyzw[:REST_FRAMES]).mean()
    position = np.median(headset.positions[:REST_FRAMES], axis=0)
    across = rotation.apply([1.0, 0.0, 0.0]) * [1.0, 0.0, 1.0]
    across /= np.linalg.norm(across)
    beside = (mesh.vertices @ rotation.as_matrix().T @ across).max() + POST_GAP_M + POST_M[0] / 2
    post = trimesh.creation.box(POST_M)
    rows = len(headset.times_ns)
    yaw = Rotation.from_rotvec([0.0, np.arctan2(-across[2], across[0]), 0.0]).as_quat()
    poses = {"headset": (headset.positions, headset.quaternions_xyzw)}
    for name, side in (("left post", -1.0), ("right post", 1.0)):
        poses[name] = (np.tile(position + side * beside * across, (rows, 1)), np.tile(yaw, (rows, 1)))
    meshes = {"headset": (mesh.vertices, mesh.faces)} | dict.fromkeys(list(poses)[1:], (post.vertices, post.faces))
    return Session.from_arrays(headset.times_ns, poses, meshes=meshes, facts={"pseudonym": participant})


def write_class(folder: Path) -> None:
    """Runs of all participants, and the class page about them, in ``folder``/class."""
    home = folder / "class"
    (home / "sessions").mkdir(parents=True, exist_ok=True)
    mapping = home / "columns.toml"
    mapping.write_text(CLASS_MAPPING, encoding="utf-8")
    for participant, numbers in CLASS_FILES.items():
        for number in numbers:
            session = participant_session(folder / f"subject__{number}.txt", participant, mapping)
            write_session(session, home / "sessions" / f"{participant}-{number}.mcap")
    main(["run", str(home / "sessions"), "--out", str(home / "runs"), "--no-picture", "--force"])
    main(["study", "page", str(home / "runs"), "--out", str(home / "page"), "--force"])


def class_figures(folder: Path) -> dict[str, str]:
    """What the page says of the participants, by the word that stands for it."""
    runs = folder / "class" / "runs"
    if not runs.is_dir():
        sys.exit("the sessions of the participants were not run; do so with `class` first")
    tables = {name: table.to_pylist() for name, table in replay.read(runs).items()}
    metrics = [line for line in tables["metrics"] if line["detector"] == "exact"]
    contacts = [line for line in tables["episodes"] if line["detector"] == "exact"]
    count = Counter(line["run"] for line in contacts)
    rows = []
    for label in LINEUP:
        faults = Counter(line["kind"] for line in tables["misses"] if line["detector"] == label)
        late = faults["found late"] + faults["lost early"]
        longest = max(1e3 * (line["end"] - line["start"]) for line in tables["misses"] if line["detector"] == label)
        rows.append(f"| {label} | {faults.total() - late} | {late} | {longest:.0f} ms |")
    return {
        "class: participants": str(len({line["student"] for line in metrics})),
        "class: sessions": str(len(metrics)),
        "class: minutes": f"{sum(line['valid_minutes'] for line in metrics):.0f}",
        "class: contacts": str(len(contacts)),
        "class: fewest": str(min(count[line["run"]] for line in metrics)),
        "class: most": str(max(count.values())),
        "class: table": "\n".join(rows),
    }


def screenshot(address: str, picture: Path, height: int) -> None:
    """What a browser shows of a page in a window of 1,280 pixels."""
    with TemporaryDirectory() as profile:
        subprocess.run(
            ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
             "--disable-background-networking", f"--screenshot={picture}", f"--window-size=1280,{height}",
             f"--user-data-dir={profile}", address],
            check=True, capture_output=True,
        )  # fmt: skip


def draw_pictures(folder: Path) -> None:
    """The first screen of two reports, and where a lost tracker says that it is."""
    home = folder / "pictures"
    home.mkdir(exist_ok=True)
    for recording in RECORDINGS:
        file = recording.find(folder)
        if recording.name not in PICTURES or file is None:
            continue
        session = home / f"{recording.name}.mcap"
        write_session(imported(file, folder), session)
        out = home / recording.name
        main(["run", str(session), "--out", str(out), "--no-picture", "--force"])
        screenshot((out / "report.html").resolve().as_uri(), SHOTS / f"{recording.name}.png", PICTURES[recording.name])
    lost = next(recording for recording in RECORDINGS if recording.name == "tracker-august").find(folder)
    if lost is not None:
        draw_lost(np.loadtxt(lost)[:, :3], SHOTS / "tracker-august.png")


def draw_lost(positions: np.ndarray, picture: Path) -> None:
    """The distance of a tracker from where it lies: valid numbers, and most metres off while it is lost."""
    from matplotlib.figure import Figure

    seconds = np.arange(len(positions)) / 250
    lost = ~np.any(positions != 0.0, axis=1)
    away = np.linalg.norm(positions - np.median(positions[~lost], axis=0), axis=1)
    figure = Figure(figsize=(12.8, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(seconds, np.where(lost, np.nan, away), color="#2b79c9", linewidth=2)
    axes.plot(seconds, np.where(lost, away, np.nan), color="#c8202f", linewidth=3)
    axes.annotate(
        f"{int(lost.sum())} rows at the origin, unturned: lost, and written as a pose like any other",
        (seconds[lost].mean(), away[lost].max()), xytext=(170, 0), textcoords="offset points", ha="left", va="center",
        color="#c8202f", fontsize=13,
    )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("seconds")
    axes.set_ylabel("metres from its place")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(picture, dpi=100)


def sources_table() -> str:
    """Markdown: a row for each commit that recordings come from, with their names, device and licence."""
    names: dict[tuple[str, str, str, str], list[str]] = {}
    for recording in RECORDINGS:
        key = (recording.device, recording.repository, recording.commit, recording.licence)
        names.setdefault(key, []).append(f"{recording.name} (`{Path(recording.path).name}`)")
    lines = ["| recordings | device | repository, commit | licence |", "|---|---|---|---|"]
    for (device, repository, commit, licence), files in names.items():
        link = f"[{repository}](https://github.com/{repository}), {commit[:7]}"
        lines.append(f"| {', '.join(files)} | {device} | {link} | {licence} |")
    return "\n".join(lines)


def section(folder: Path) -> str:
    """The section: the text beside this module, with its tables and figures filled in."""
    measured = list(rows(folder))
    table = [HEAD, ["---"] * len(HEAD), *measured]
    text = TEXT.read_text("utf-8")
    text = text.replace("{measured}", "\n".join(f"| {' | '.join(cells)} |" for cells in table))
    text = text.replace("{sources}", sources_table())
    for word, value in class_figures(folder).items():
        text = text.replace(f"{{{word}}}", value)
    for cells in measured:
        for heading, cell in zip(HEAD, cells, strict=True):
            text = text.replace(f"{{{cells[0]}: {heading}}}", cell)
    return text.rstrip("\n")


def write_section(folder: Path) -> None:
    """Put the section between its marks on the guide's page of results."""
    results = PAGES_FOLDER / "results.md"
    results.write_text(with_table(results.read_text("utf-8"), section(folder), BEGIN, END), encoding="utf-8")


def fetch_commands(folder: Path) -> Iterator[str]:
    """Shell commands that put every recording, and the mesh of the wand, into a folder."""
    yield f"mkdir -p {folder}"
    for repository in dict.fromkeys(item.repository for item in RECORDINGS):
        clone = repository.rpartition("/")[2]
        yield f"git clone https://github.com/{repository} {folder}/{clone}"
        for item in RECORDINGS:
            if item.repository == repository:
                yield f"git -C {folder}/{clone} show {item.commit}:{item.path} > {folder}/{item.file}"
    clone = CLASS_REPOSITORY.rpartition("/")[2]
    yield f"git clone https://github.com/{CLASS_REPOSITORY} {folder}/{clone}"
    for number in sorted(sum(CLASS_FILES.values(), ())):
        name = f"subject__{number}.txt"
        yield f"git -C {folder}/{clone} show {CLASS_COMMIT}:Data/{name} > {folder}/{name}"
    yield f"npm pack @webxr-input-profiles/assets@1.0.20 --pack-destination {folder}"
    inside = "package/dist/profiles/htc-vive/none.glb"
    yield f"tar -xzOf {folder}/webxr-input-profiles-assets-1.0.20.tgz {inside} > {folder}/{WAND}"


VERBS = {
    "fetch": lambda folder: print("\n".join(fetch_commands(folder))),
    "page": write_section,
    "class": write_class,
    "pictures": draw_pictures,
}

if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in VERBS:
        sys.exit(__doc__)
    VERBS[sys.argv[1]](Path(sys.argv[2]))
