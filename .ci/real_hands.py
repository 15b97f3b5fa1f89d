"""Makes the guide's table of people who drink from glasses: recorded hands, and the colliders shipped for the vessels.

python .ci/real_hands.py fetch FOLDER    prints the commands that put the models and recordings into FOLDER
python .ci/real_hands.py page FOLDER     writes the table on the guide's page *Results*; says so where FOLDER lacks them
python .ci/real_hands.py pictures FOLDER draws the first screen of each recording's report into .github/pictures
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
from choosing import with_table
from PIL import Image
from real_recordings import SHOTS, screenshot

import replay
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.protocol import counts_as_contact
from replay.advice.overlap_depth import SampledSurface, overlap_depth
from replay.cli.main import main
from replay.document.run_result import RunResult
from replay.guide.pages import PAGES_FOLDER
from replay.words import as_percentage
from sessions import Session, import_session, write_session
from sessions.scene_files.scene_meshes import with_scene

BEGIN: Final = "<!-- begin of the table that real_hands.py makes -->"
END: Final = "<!-- end of the table that real_hands.py makes -->"
HEAD: Final = (
    "| recording | pair-frames | contact | python-fcl differs | hull false | shipped false | our pieces false "
    "| deepest |\n|---|---|---|---|---|---|---|---|"
)
REPOSITORIES: Final = {
    "MyoHub/myosuite": ("8928f49f79b4be344e1bfbc6a72f404ebd0630dc", "."),
    "MyoHub/myo_sim": ("2cef885481677742e4d19adb934b1b7be438cf6a", "myosuite/simhive/myo_sim"),
    "vikashplus/object_sim": ("5257bbdbe7e3af32aae5ad67ffa1d4402ac2e871", "myosuite/simhive/object_sim"),
    "vikashplus/furniture_sim": ("c97995afb81c9e2d7325b0069f9abc9a2c74a2f0", "myosuite/simhive/furniture_sim"),
}
"""Repository -> commit, and its place within the first. All have the Apache License 2.0.

MyoDM's Readme asks to comply with the licence of GRAB too, whose recordings its pre-grasps come from.
"""

MODEL: Final = "myosuite/envs/myo/assets/hand/myohand_object.xml"
MOTIONS: Final = "myosuite/envs/myo/myodm/data"
HAND: Final = '[[group]]\nname = "hand"\nmembers = ["*mc", "*thumb", "*ph[2345]"]\n'
PICTURE_HEIGHT: Final = 720
COLOURS: Final = 128
"""Colours of a picture: it takes a third of the bytes, and no difference is seen."""
DEPTH_FRAMES: Final = 200
"""Pair-frames in contact whose overlap is measured, evenly spread."""


@dataclass(frozen=True)
class Clip:
    """A recording of MyoDM and the vessel in it."""

    title: str
    vessel: str
    motion: str


CLIPS: Final = (
    Clip("wine glass, drink 1", "wineglass", "MyoHand_wineglass_drink1.npz"),
    Clip("mug, drink 3", "mug", "MyoHand_mug_drink3.npz"),
    Clip("bowl, drink 2", "bowl", "MyoHand_bowl_drink2.npz"),
)


def session_of(clip: Clip, folder: Path) -> Session:
    """The session of a clip, with the 19 links of the hand as one group."""
    root = folder / "myosuite"
    template = (root / MODEL).read_text(encoding="utf-8")
    # The model has a place for the name of the object, and paths from its own folder on.
    model = (root / MODEL).with_name(f"replay_{clip.vessel}.xml")
    model.write_text(template.replace("OBJECT_NAME", clip.vessel), encoding="utf-8")
    with TemporaryDirectory() as scratch:
        scene = Path(scratch) / "hand.toml"
        scene.write_text(HAND, encoding="utf-8")
        session = import_session("mjcf", model, motion=root / MOTIONS / clip.motion, root=root)
        return with_scene(session, scene)


def row(clip: Clip, folder: Path) -> str:
    """A row of the table."""
    lineup = {"hull": "collider[shape=hull]", "shipped": "collider[shape=shipped]", "exact": "exact"}
    pieces = f"collider[shape=compound,pieces=16,method=vhacd,cut={clip.vessel}]"
    result = replay.run(
        session_of(clip, folder), detectors={**lineup, "pieces": pieces}, oracle="exact", pairs=[("hand", clip.vessel)]
    )
    contact = counts_as_contact(result.detections["exact"].verdict)
    cells = [clip.title, f"{contact.size:,}", f"{int(contact.sum()):,}", str(differing(result, contact))]
    cells += [
        as_percentage(result.document.audit[label].false_contact.value or 0.0)
        for label in ("hull", "shipped", "pieces")
    ]
    cells.append(f"{1e3 * deepest(result, contact):.1f} mm")
    return f"| {' | '.join(cells)} |"


def differing(result: RunResult, contact: np.ndarray) -> int:
    """Pair-frames in which python-fcl, asked about the same meshes and poses, says otherwise."""
    assembly = result.assembly
    meshes, motion = FclMeshes([body.mesh for body in assembly.bodies]), assembly.motion
    differs = 0
    for frame in range(len(motion)):
        for body in range(len(assembly.bodies)):
            meshes.place(body, motion.rotations[frame, body], motion.translations[frame, body])
        touching = [meshes.touch(a, b) for a, b in assembly.pairs.tolist()]
        differs += int((contact[frame] != touching).sum())
    return differs


def deepest(result: RunResult, contact: np.ndarray) -> float:
    """Metres of the deepest overlap among some pair-frames in contact."""
    assembly = result.assembly
    surfaces = [SampledSurface(body.mesh) for body in assembly.bodies]
    frames, columns = np.nonzero(contact)
    chosen = np.unique(np.linspace(0, len(frames) - 1, DEPTH_FRAMES).round().astype(int))
    depth = 0.0
    for frame, column in zip(frames[chosen].tolist(), columns[chosen].tolist(), strict=True):
        a, b = assembly.pairs[column].tolist()
        depth = max(depth, overlap_depth(surfaces[a], surfaces[b], assembly.motion, frame, (a, b)))
    return depth


def fetch_commands(folder: Path) -> Iterator[str]:
    """Shell commands that put every repository where the models look for it."""
    yield f"mkdir -p {folder}"
    for repository, (commit, inside) in REPOSITORIES.items():
        target = folder / "myosuite" / inside
        yield f"rm -rf {target}" if inside != "." else f"test ! -e {target}"
        yield f"git clone https://github.com/{repository} {target}"
        yield f"git -C {target} checkout {commit}"


def is_complete(folder: Path) -> bool:
    """Whether the models and recordings are there."""
    root = folder / "myosuite"
    return (root / MODEL).is_file() and all(
        (root / inside / "LICENSE").is_file() for _, inside in REPOSITORIES.values()
    )


def table(folder: Path) -> str:
    """The table of all clips."""
    return "\n".join([HEAD, *(row(clip, folder) for clip in CLIPS)])


def write_page(folder: Path) -> None:
    """Write the table between its marks on the guide's page of results."""
    if not is_complete(folder):
        print(f"left out: {folder} lacks the models of MyoDM; fetch them: python .ci/real_hands.py fetch {folder} | sh")
        return
    results = PAGES_FOLDER / "results.md"
    results.write_text(with_table(results.read_text("utf-8"), table(folder), BEGIN, END), encoding="utf-8")


def draw_pictures(folder: Path) -> None:
    """The first screen of each recording's report: the hand, the vessel, and the colliders that were shipped for it."""
    for clip in CLIPS:
        with TemporaryDirectory() as scratch:
            session, out = Path(scratch) / f"{clip.vessel}.mcap", Path(scratch) / clip.vessel
            write_session(session_of(clip, folder), session)
            lineup = "hull=collider[shape=hull],shipped=collider[shape=shipped],exact"
            pairs = f"hand:{clip.vessel}"
            main(["run", str(session), "--out", str(out), "--no-picture", "--detectors", lineup, "--pairs", pairs])
            picture = SHOTS / f"{clip.vessel}.png"
            screenshot((out / "report.html").resolve().as_uri(), picture, PICTURE_HEIGHT)
            Image.open(picture).convert("RGB").quantize(COLOURS).save(picture, optimize=True)


VERBS = {
    "fetch": lambda folder: print("\n".join(fetch_commands(folder))),
    "page": write_page,
    "pictures": draw_pictures,
}

if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in VERBS:
        sys.exit(__doc__)
    VERBS[sys.argv[1]](Path(sys.argv[2]))
