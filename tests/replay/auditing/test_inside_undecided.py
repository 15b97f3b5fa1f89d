"""Frames in which nobody knows whether a body is inside another are in no detector's figures, and are counted."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import astuple
from support.small_worlds import cube, unit_cubes_on_x

from cdcore import Verdict
from replay.auditing.fault import Cause
from replay.document import headline
from replay.document.gates import Gates
from replay.engine import compute
from sessions import MeshData

PATH = [9.0, 5.5, 4.8, 3.0, 1.0, 0.0, 0.0, -1.0, -2.0]
"""X of a cube of 1 m, frame by frame, which moves into a block of 9 m about the origin, whose side is at x = 4.5 m.

In frames 0 and 1 it is beside the block, in frame 2 (4.3 to 5.3 m) in its side, then inside.
"""

REQUESTED = "hull=collider,mesh=collider[shape=mesh],exact,hybrid"


def merged_mesh(*meshes):
    """One mesh of the vertices and faces of several."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return MeshData(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def cube_mesh(scale=9.0, shift=0.0, lost=()):
    """A cube with an edge of ``scale`` metres, shifted along each axis, without the faces ``lost``."""
    box = cube()
    return MeshData(scale * box.vertices + shift, np.delete(box.faces, list(lost), axis=0))


def reversed_faces(mesh):
    """The mesh inside out."""
    return MeshData(mesh.vertices, mesh.faces[:, ::-1])


def side(axis):
    """Faces of a cube's side towards -axis."""
    return np.flatnonzero((cube().triangles[:, :, axis] == cube().bounds[0, axis]).all(axis=1)).tolist()


BLOCKS = {
    "sound": cube_mesh(),
    **{f"lacks face {k}": cube_mesh(lost=[k]) for k in range(12)},
    "inwards, lacks a face": reversed_faces(cube_mesh(lost=[3])),
    "lacks a side": cube_mesh(lost=side(axis=1)),
    "lacks the side that is entered": cube_mesh(lost=[k for k in range(12) if k in side(axis=0)]),
    "doubled": merged_mesh(cube_mesh(), cube_mesh()),
    "double-sided": merged_mesh(cube_mesh(), reversed_faces(cube_mesh())),
    "one face doubled": merged_mesh(cube_mesh(), MeshData(cube_mesh().vertices, cube_mesh().faces[:1])),
    "crossing": merged_mesh(cube_mesh(), cube_mesh(scale=9.0, shift=[-4.0, 1.0, 1.0])),
    "crossing, one reversed": merged_mesh(cube_mesh(), reversed_faces(cube_mesh(scale=9.0, shift=[-4.0, 1.0, 1.0]))),
    "nested": merged_mesh(cube_mesh(), cube_mesh(scale=8.0)),
}


def audited(mesh):
    """A run in which a cube of 1 m moves along PATH into a block with this mesh."""
    session = unit_cubes_on_x({"block": [0.0] * len(PATH), "probe": PATH})
    return compute(replace(session, meshes={"block": mesh, "probe": cube()}), detectors=REQUESTED, oracle="exact")


SLOW_BLOCKS = {f"lacks face {k}" for k in range(12) if k % 5}
"""A lacking face is as another for a probe that enters elsewhere: three of the twelve are quick."""

UNDECIDED_INSIDE = {"lacks a side", "lacks the side that is entered", "crossing, one reversed"}
"""Blocks that are open, or whose faces contradict each other about which side is inside."""


@pytest.mark.sampled(22)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW_BLOCKS else []) for name in BLOCKS]
)
def test_no_detector_is_blamed_inside_a_damaged_block(name):
    """A cube moves along PATH into a block with the named damage: outside it for two frames, then in or through it.

    The reference, ``exact``, leaves frames undecided only inside the blocks of UNDECIDED_INSIDE. Such frames are in no
    detector's misses or false contacts, every detector's audit has their number, and a line names the block.
    """
    run = audited(BLOCKS[name])
    truth = run.detections[run.oracle].verdict[:, 0]
    assert truth[:2].tolist() == [Verdict.CLEAR] * 2
    assert (truth[2:] != Verdict.CLEAR).all()
    undecided = int((truth == Verdict.UNRESOLVED).sum())
    assert (undecided > 0) == (name in UNDECIDED_INSIDE)

    assert {"hull", "mesh", "hybrid"} <= {*run.document.audit}
    for label, audit in run.document.audit.items():
        assert not run.false[label]
        assert audit.contacts_missed == 0 and audit.pair_frames.missed == 0
        assert audit.reference_undecided == undecided
        assert sum(astuple(audit.pair_frames)) == len(PATH), "every frame is counted as something"

    lines = [line for line in headline.undecided_lines(run) if "frames" in line]
    if undecided:
        assert lines[0].startswith(f"Not counted: {undecided} frames (inside undecided: block has ")
    else:
        assert lines == []


def test_frames_that_are_not_counted_break_no_gate():
    """In a block that lacks a side it is undecided in some frames whether the cube is inside.

    They are neither missed nor false: a gate that allows no missed and no false contact lets the run pass.
    """
    run = audited(BLOCKS["lacks a side"])
    assert run.document.audit["hull"].reference_undecided > 0
    assert Gates(max_missed=0.0, max_false=0.0).broken_limits(run.document.audit, []) == []


def test_a_hollow_needs_a_reference_that_knows_the_side():
    """Two cubes of 3 m, their middles at x = -4 and 4 m, are one mesh; a cube of 1 m stands in the gap of 5 m.

    It touches neither and is within their convex hull, so ``hull`` reports a false contact, which fills a hollow.
    Only a reference that decides about containment knows that the cube is not in the solid; else the cause is another.
    """
    walls = merged_mesh(cube_mesh(scale=3.0, shift=[-4.0, 0, 0]), cube_mesh(scale=3.0, shift=[4.0, 0, 0]))
    outside, in_the_gap = 9.0, 0.0
    session = unit_cubes_on_x({"walls": [0.0] * 4, "probe": [outside, in_the_gap, in_the_gap + 0.5, outside]})
    session = replace(session, meshes={"walls": walls, "probe": cube()})
    causes = {}
    for oracle in ("exact", "exact[containment=false]"):
        run = compute(session, detectors="hull=collider[shape=hull]", oracle=f"reference={oracle}")
        causes[oracle] = {false.cause for false in run.false["hull"]}
    assert causes["exact"] == {Cause.HULL_FILLS_HOLLOW}
    assert causes["exact[containment=false]"], "the contact is false by this reference too"
    assert Cause.HULL_FILLS_HOLLOW not in causes["exact[containment=false]"]
