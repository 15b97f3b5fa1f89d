"""The guide's tables of engines beside their re-creation: ``python .ci/real_engines.py DATA [--write]``.

``DATA`` is a folder with the recordings of A-Frame and the mesh of a VIVE wand that the page names; without ``--write``
the tables are printed.
"""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from choosing import with_table

from cdcore import Motion
from cdcore.bounding.hull import hull_collider
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.numerics import BoolArray
from cdcore.protocol import counts_as_contact, is_undecided
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.guide.pages import PAGES_FOLDER
from replay.prepare.assemble import assemble
from replay.prepare.assembly import Assembly

BEGIN: Final = "<!-- begin of the tables that real_engines.py makes -->"
END: Final = "<!-- end of the tables that real_engines.py makes -->"
HEAD: Final = (
    "| engine | our row | pair-frames | both in contact | engine alone | ours alone | hulls apart there, mm "
    "| not supported |\n|---|---|---|---|---|---|---|---|"
)

DEMO: Final = "the demo"
RECORDINGS: Final = ("grabLeft", "tracked-recording")
WAND: Final = "webxr-vive-controller/htc-vive-none.glb"


@dataclass(frozen=True)
class Twin:
    """A row that asks an engine, and the row of ours that re-creates it; ``dense``: also between large meshes."""

    engine: str
    ours: str
    dense: bool = True


TWINS: Final = (
    Twin("mujoco", "collider[shape=hull]"),
    Twin("mujoco[rate_hz=50]", "collider[shape=hull,rate_hz=50]"),
    Twin("physx[contact_offset_m=0.01]", "collider[shape=hull,skin_m=0.01]"),
    Twin("physx[contact_offset_m=0.01,rate_hz=50]", "collider[shape=hull,skin_m=0.01,rate_hz=50]"),
    # PhysX and Bullet test no pair of two such meshes; two wands of 17,344 triangles take Rapier minutes a frame.
    Twin("physx[shape=mesh,contact_offset_m=0.01]", "collider[shape=mesh,skin_m=0.01]", dense=False),
    Twin("rapier", "collider[shape=hull,skin_m=0.01]"),
    Twin("rapier[prediction_m=0]", "collider[shape=hull]"),
    Twin("rapier[shape=mesh]", "collider[shape=mesh,skin_m=0.01]", dense=False),
    Twin("bullet", "collider[shape=hull,skin_m=0.001]"),
    Twin("bullet[shape=mesh]", "collider[shape=mesh,skin_m=0.001]", dense=False),
)


MOST_GAPS: Final = 400
"""Of the pair-frames in which two rows differ, those whose distance is measured."""


@dataclass(frozen=True)
class TwinCounts:
    """How two rows answer the same pair-frames.

    ``equal``, ``engine_only`` (contact for the engine alone), ``ours_only``: pair-frames that both decide; ``both``:
    those of ``equal`` in which both say contact. ``not_supported``: pair-frames that the engine cannot test.
    ``gaps_mm``: shortest and longest distance between the hulls where the rows differ, ``None`` where they never do.
    """

    equal: int
    both: int
    engine_only: int
    ours_only: int
    not_supported: int
    gaps_mm: tuple[float, float] | None


def compare_twins(assembly: Assembly, engine: str, ours: str) -> TwinCounts:
    """Ask two rows, each as in ``--detectors``, about every pair-frame of a session, and count where they differ."""
    requested, recreated = (
        make_detector(parse_detector(row), assembly, 0).detect(assembly.motion).verdict for row in (engine, ours)
    )
    posed = assembly.motion.valid[:, assembly.pairs].all(axis=2)
    decided = posed & ~is_undecided(requested) & ~is_undecided(recreated)
    other, own = counts_as_contact(requested), counts_as_contact(recreated)
    differ = decided & (other != own)
    return TwinCounts(
        equal=int((decided & ~differ).sum()),
        both=int((decided & other & own).sum()),
        engine_only=int((differ & other).sum()),
        ours_only=int((differ & own).sum()),
        not_supported=int((posed & is_undecided(requested)).sum()),
        gaps_mm=_gaps(assembly, differ),
    )


def _gaps(assembly: Assembly, differ: BoolArray) -> tuple[float, float] | None:
    indices = np.argwhere(differ)
    if not len(indices):
        return None
    hulls = FclMeshes([hull_collider(body.mesh) for body in assembly.bodies])
    motion: Motion = assembly.motion
    gaps = []
    for frame, pair in indices[:: -(-len(indices) // MOST_GAPS)].tolist():
        a, b = assembly.pairs[pair].tolist()
        for body in (a, b):
            hulls.set_pose(body, motion.rotations[frame, body], motion.translations[frame, body])
        gaps.append(max(0.0, hulls.gap(a, b)[0]) * 1000)
    return min(gaps), max(gaps)


def sessions(data: Path) -> Iterator[tuple[str, Assembly]]:
    """The sessions of the page: the demo, and recordings with a wand in place of each controller."""
    from sessions import import_session
    from sessions.synthetic.scenes import make_scene_session

    yield DEMO, assemble(make_scene_session("bench-bumps")[0])
    for name in RECORDINGS:
        file = data / "aframe-motion-capture" / f"{name}.json"
        wands = dict.fromkeys(("left", "right"), data / WAND)
        yield f"`{name}`", assemble(import_session("aframe", file, meshes=wands))


def twin_table(title: str, rows: Mapping[Twin, TwinCounts]) -> str:
    """Markdown: a row for each pair of rows, below the name of the session."""
    return "\n".join([f"### {title[0].upper()}{title[1:]}", "", HEAD, *(_row(twin, rows[twin]) for twin in rows)])


def _row(twin: Twin, counts: TwinCounts) -> str:
    requested = counts.equal + counts.engine_only + counts.ours_only
    where = "-" if counts.gaps_mm is None else "{:.1f} to {:.1f}".format(*counts.gaps_mm)
    numbers = (requested, counts.both, counts.engine_only, counts.ours_only, where, counts.not_supported)
    cells = (f"{cell:,}" if isinstance(cell, int) else cell for cell in numbers)
    return f"| `{twin.engine}` | `{twin.ours}` | " + " | ".join(cells) + " |"


def tables(data: Path) -> str:
    """All tables of the page; takes ten minutes, most of them PhysX's."""
    pieces = []
    for title, assembly in sessions(data):
        chosen = [twin for twin in TWINS if twin.dense or title == DEMO]
        pieces.append(twin_table(title, {twin: compare_twins(assembly, twin.engine, twin.ours) for twin in chosen}))
    return "\n\n".join(pieces)


if __name__ == "__main__":
    made = tables(Path(sys.argv[1]))
    if "--write" in sys.argv[2:]:
        results = PAGES_FOLDER / "results.md"
        results.write_text(with_table(results.read_text("utf-8"), made, BEGIN, END), encoding="utf-8")
    else:
        print(made)
