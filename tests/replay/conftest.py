"""Tests of this folder begin when the common kernels are compiled, and prepare, cut and measure each mesh once."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from cdcore import TriangleMesh
from replay.advice import collider_search, overlap_depth, scene_outcome
from replay.cutting import piece_store, solid_overlap, surface_distance
from replay.detection import compile_notice
from replay.prepare import assemble
from replay.show.report import still
from sessions.doctor import meshes


@pytest.fixture(autouse=True, scope="session")
def wait_for_kernels(common_kernels):
    """Waits once a worker; no run starts a process that compiles the same kernels again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "cpu_count", lambda: 1)
        compile_notice.compile_beside()


@pytest.fixture(autouse=True, scope="session")
def keep_pieces_in_shared_folder(shared_pieces):
    """No test reads or writes the pieces of the user."""


class FinishedCut:
    """A process that has ended: its program ran here, which spares 0.4 s of imports. Arguments are those of `Popen`."""

    def __init__(self, command, **_options):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", command[3:])
            try:
                exec(command[3], {})
                self.returncode = 0
            except SystemExit as end:
                self.returncode = end.code

    def wait(self, timeout=None):
        """Returns at once: the program has ended."""
        return self.returncode

    poll = wait


@pytest.fixture(autouse=True, scope="session")
def cuts_in_this_process():
    """Own methods cut meshes in the process of the tests; planted programs and those of packages get a process.

    A test of the process that cuts sets ``piece_store.subprocess`` to `subprocess`.
    """
    usual_program = piece_store.CUTTING_PROGRAM

    def start(command, **options):
        is_own = command[3] == usual_program and command[5] in ("sectors", "planes")
        return (FinishedCut if is_own else subprocess.Popen)(command, **options)

    with pytest.MonkeyPatch.context() as patch:
        names = {"DEVNULL": subprocess.DEVNULL, "TimeoutExpired": subprocess.TimeoutExpired}
        patch.setattr(piece_store, "subprocess", SimpleNamespace(Popen=start, **names))
        yield


@pytest.fixture(autouse=True, scope="session")
def shared_meshes():
    """Equal meshes of sessions are one object, for which trees, hulls and solids are built once a worker."""
    mesh_of_hash = {}

    def shared_mesh(vertices, faces):
        mesh = TriangleMesh(vertices, faces)
        return mesh_of_hash.setdefault(mesh.content_hash, mesh)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assemble, "TriangleMesh", shared_mesh)
        yield


@pytest.fixture(autouse=True, scope="session")
def shared_mesh_findings():
    """The doctor examines equal meshes once a worker: every run of a session begins with its meshes."""
    examine = meshes.mesh_findings
    findings = {}

    def examine_once(name, mesh):
        key = name, mesh.vertices.tobytes(), mesh.faces.tobytes()
        if key not in findings:
            findings[key] = tuple(examine(name, mesh))
        return iter(findings[key])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshes, "mesh_findings", examine_once)
        yield


@pytest.fixture(autouse=True, scope="session")
def shared_depths():
    """The depth of a common part is searched once a worker: many tests run the same few sessions."""

    def searched_once(search):
        depths = {}

        def search_once(triangles, surface, least_distance):
            key = triangles.tobytes(), surface.triangles.tobytes(), least_distance
            if key not in depths:
                depths[key] = search(triangles, surface, least_distance)
            return depths[key]

        return search_once

    with pytest.MonkeyPatch.context() as patch:
        for name in ("farthest_on", "farthest_within"):
            patch.setattr(solid_overlap, name, searched_once(getattr(solid_overlap, name)))
        yield


@pytest.fixture(autouse=True, scope="session")
def coarse_stills():
    """Pictures of faults in reports have a fifth of their pixels each way; yields the usual pixels per unit."""
    usual = dict(still.PIXELS_PER_UNIT)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(still, "PIXELS_PER_UNIT", {size: factor / 5 for size, factor in usual.items()})
        yield usual


@pytest.fixture(scope="module")
def quickest_cutter_only():
    """Bodies are cut by the quickest method alone: others, and joins by the motion, take seconds for each body.

    How far pieces reach beyond a mesh is sampled coarsely, which took two fifths of a search; its own tests do not.
    Yields the join by the motion, for tests of it.
    """
    join_by_motion = collider_search.ColliderSearch.join_by_motion
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(collider_search, "OTHER_METHODS", ())
        patch.setattr(surface_distance, "SAMPLES_PER_SIZE", 12)
        patch.setattr(collider_search.ColliderSearch, "join_by_motion", lambda *_: None)
        yield join_by_motion


@pytest.fixture(scope="module")
def few_depth_frames():
    """Questions about a recording measure the depth of overlaps in 6 contact frames, not in 24: most of their time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_outcome, "DEPTH_FRAMES", 6)
        yield


@pytest.fixture(scope="module")
def few_surface_points():
    """Depths of overlaps are estimated by 1,000 points of a surface, not by 4,000: a third of the time of questions."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(overlap_depth, "SURFACE_POINTS", 1000)
        yield
