"""Newton decides as exact hulls do, loses no contact for want of room, and reports what it compiles."""

import subprocess
import sys

import numpy as np
import pytest
from support.shapes import beaker_mesh, box_mesh, lab_bodies_and_motion, merge_meshes, motion_at_rest, rod_mesh

from cdcore import Body, Verdict, create_detector
from cdcore.engines import newton_world
from cdcore.errors import InvalidMeshError, MissingEngineError
from cdcore.kernels.compiling import compiling_reported
from cdcore.protocol import counts_as_contact

pytest.importorskip("newton", reason="newton is no part of `test`: the extra of that name")
warp = pytest.importorskip("warp")

pytestmark = pytest.mark.slow
"""Loading its kernels takes seconds, compiling them minutes."""


def overlapping_boxes(count):
    """Boxes of 0.1 m about the origin, some 1 cm from each other, and their motion."""
    bodies = [Body(f"box {k}", box_mesh((0.1, 0.1, 0.1))) for k in range(count)]
    return bodies, motion_at_rest(bodies, np.random.default_rng(0).normal(scale=0.01, size=(count, 3)))


def test_newton_agrees_with_hulls_in_every_frame():
    """Five bodies in a laboratory, 60 frames, over 100 contacts; ``collider`` tests their convex hulls exactly."""
    bodies, motion = lab_bodies_and_motion(frames=60)
    newton, hulls = (
        counts_as_contact(create_detector(name, bodies).detect(motion).verdict) for name in ("newton", "collider")
    )
    assert hulls.sum() > 100
    assert np.array_equal(newton, hulls)


def test_buffer_without_room_grows_and_loses_no_contact(monkeypatch):
    """Room for one contact; all 28 pairs of 8 boxes meet, so that it must grow to more than 28."""
    monkeypatch.setattr(newton_world, "LEAST_ROOM", 1)
    monkeypatch.setattr(newton_world, "CONTACTS_PER_PAIR", 0)
    bodies, motion = overlapping_boxes(count=8)
    detector = create_detector("newton", bodies)
    assert counts_as_contact(detector.detect(motion).verdict).all()
    assert detector.world.contact_room > 28


def test_triangles_without_room_grow_and_lose_no_contact(monkeypatch):
    """Room for two pairs of triangles; a rod stands in the floor of a beaker, which crosses more of them."""
    monkeypatch.setattr(newton_world, "TRIANGLE_PAIRS", 2)
    bodies = [Body("beaker", beaker_mesh()), Body("rod", rod_mesh())]
    motion = motion_at_rest(bodies, [[0, 0, 0], [0, 0, 0]])
    detector = create_detector("newton", bodies, shape="mesh")
    assert detector.detect(motion).verdict.tolist() == [[Verdict.CONTACT]]
    assert detector.world.triangle_room > 2


def test_more_contacts_than_there_is_room_for_are_refused(monkeypatch):
    """The 28 pairs of 8 boxes meet, and room may grow to 10 contacts."""
    monkeypatch.setattr(newton_world, "LEAST_ROOM", 1)
    monkeypatch.setattr(newton_world, "CONTACTS_PER_PAIR", 0)
    monkeypatch.setattr(newton_world, "LARGEST_ROOM", 10)
    monkeypatch.setattr(newton_world, "TRIANGLE_PAIRS", 1)
    bodies, motion = overlapping_boxes(count=8)
    with pytest.raises(InvalidMeshError, match=r"^Newton has no room for the contacts of these meshes, more than 10 "):
        create_detector("newton", bodies).detect(motion)


@pytest.mark.parametrize(
    ("height", "verdict"),
    [pytest.param(0.0, Verdict.CLEAR, id="middle in the sheet"), pytest.param(0.02, Verdict.CONTACT, id="2 cm above")],
)
def test_hull_whose_middle_is_inside_a_mesh_is_clear(height, verdict):
    """A rod of 20 cm through a sheet 1 cm thick: Newton misses it where its middle is in the sheet, a limit it states.

    ``exact`` sees contact at both heights. A stub, about 0.5 m from the rod, makes the body of the sheet not convex:
    convex ones are tested as hulls, others as meshes.
    """
    sheet, stub = box_mesh((1.0, 1.0, 0.01)), box_mesh((0.1, 0.1, 0.5), centre=(0.4, 0.4, 0.3))
    bodies = [Body("corner", merge_meshes(sheet, stub)), Body("rod", box_mesh((0.005, 0.005, 0.2)))]
    motion = motion_at_rest(bodies, [[0, 0, 0], [0.01, 0.02, height]])
    assert create_detector("exact", bodies).detect(motion).verdict.tolist() == [[Verdict.CONTACT]]
    assert create_detector("newton", bodies, shape="mesh").detect(motion).verdict.tolist() == [[verdict]]


def test_kernels_compiled_by_newton_are_reported(monkeypatch):
    """A stand-in for Warp's compiler notes one file: one kernel is reported, its seconds, and the
    folder of its code.
    """
    seconds, compiled_files = [], []
    monkeypatch.setattr(warp._src.build, "build_cpu", lambda path, **_: compiled_files.append(path))
    with compiling_reported(seconds.append) as report, newton_world.reporting_compilation(warp):
        warp._src.build.build_cpu("kernel.o", mode="release")
    assert compiled_files == ["kernel.o"]
    assert len(seconds) == 1
    assert (report.kernels, report.engine) == (1, "Newton")
    assert report.folder == warp.config.kernel_cache_dir


def test_cache_that_cannot_be_written_is_one_clear_error(monkeypatch):
    """Starting Warp raises PermissionError, as where no folder can be written."""

    def refused():
        raise PermissionError("no")

    monkeypatch.setattr(warp, "init", refused)
    with pytest.raises(MissingEngineError, match=r"^newton can keep its kernels nowhere; set WARP_CACHE_PATH to "):
        create_detector("newton", overlapping_boxes(count=2)[0])


def test_second_process_compiles_nothing():
    """Two processes, one after the other, make a detector of two tetrahedra and print how many kernels they compiled:
    the second none.
    """
    code = (
        "from cdcore import Body, TriangleMesh, create_detector; import numpy as np;"
        "from cdcore.kernels.compiling import compiling_reported;"
        "mesh = TriangleMesh(np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);"
        "context = compiling_reported(lambda _: None); report = context.__enter__();"
        "create_detector('newton', [Body('a', mesh), Body('b', mesh)]); print(report.kernels)"
    )
    _first, second = (
        subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True) for _ in range(2)
    )
    assert (second.stdout.strip(), second.stderr) == ("0", "")
