"""Compiles the kernels of the paper's search, of ``exact`` and of what examines its contacts, in the order of a run.

A first run starts this in a process of its own (``python -m cdcore.detectors.compile_beside``). Meanwhile the run
itself compiles what it needs first: the traversal of ``exact``, which comes last here, and the volumes, which this
leaves out. What one process has compiled the other loads.
"""

import gc

import numpy as np

from cdcore.containment.winding_number import winding_numbers
from cdcore.detectors.detector_table import create_detector
from cdcore.image_space.pixel_spans import pixels_of_spans, row_spans
from cdcore.mesh import TriangleMesh
from cdcore.narrow.greatest_minimum import greatest_minimum
from cdcore.narrow.ill_posed import MarginStage
from cdcore.narrow.sections.section_source import section_of_faces
from cdcore.narrow.surface_distance import distance_to_triangles, largest_distance, nearest_triangles
from cdcore.protocol import Body, Motion
from cdcore.search.stage import SearchStage

FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))


def compile_kernels() -> None:
    """Ask one small question of each kernel: tetrahedra in contact, within a box, one inside the other, touching."""
    tetrahedron = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    large, small = (
        Body(name, TriangleMesh(size * tetrahedron, FACES)) for name, size in (("large", 1), ("small", 0.1))
    )
    translations = np.zeros((3, 2, 3))
    translations[:, 1] = [[0.1, 0.1, -0.05], [0.6, 0.6, 0.6], [0.2, 0.2, 0.2]]
    rotations = np.tile(np.eye(3), (3, 2, 1, 1))
    motion = Motion([0.0, 1.0, 2.0], translations, rotations)
    # ``exact`` asks first whether its contacts could be others; a run that is this far compiled it once more (2026-11).
    margins = MarginStage((large, small), 1e-6)
    margins.near((0, 1), rotations[1:2], translations[1:2])
    # Only the search: a whole detector would compile the volumes before it, as the run does at the same time.
    search = SearchStage([large, small], np.array([[0, 1]]), create_detector("hybrid-qaco", [large, small]).settings)
    search.decide(motion, np.ones((3, 1), dtype=np.bool_), search.fresh_memory(), faces=True)
    (at_large, at_small), faces = zip(rotations[0], translations[0], strict=True), np.array([[0, 1]])
    margins.shallow((0, 1), faces, rotations[0], translations[0])
    section_of_faces(large, at_large, small, at_small, faces)
    # A copy, as depths are searched: numba compiles a kernel once more for an array that cannot be written.
    triangles, point = large.mesh.triangles.copy(), translations[0, :1]
    distance_to_triangles(point, triangles[:1])
    for distances in (nearest_triangles, largest_distance):
        distances(point, triangles, triangles.mean(axis=1), np.ones(len(triangles)))
    greatest_minimum(np.eye(3), np.ones(3), np.eye(3), np.ones(3))
    exact, touching = create_detector("exact", [large, small]), translations[:1].copy()
    touching[0, 1] = [0.2, 0.2, -0.1]  # a corner in the plane of a face: decided in exact arithmetic
    exact.detect(Motion([0.0], touching, rotations[:1]), faces=True)
    winding_numbers(point, triangles)
    exact.detect(motion, faces=True)
    rows = np.arange(2)
    pixels_of_spans(row_spans(rotations[0], rows, rows + 1, 3).part(slice(0, 2)), 3, 1.0)


if __name__ == "__main__":
    gc.disable()  # a compiler makes few cycles: looking for them took an eighth of the time (2026-11)
    compile_kernels()
