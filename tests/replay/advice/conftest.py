"""Two stirred beakers, and pieces of the second that miss every contact."""

import numpy as np
import pytest
import trimesh
from support.shapes import revolved_mesh
from support.small_worlds import STEP_NS, unit_cubes_on_x

from cdcore import TriangleMesh
from replay.advice import collider_search, measured_fix
from replay.cutting import compound, piece_store
from sessions import MeshData, Session

WALL = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
ROD = [(0, 0), (0.003, 0), (0.003, 0.2), (0, 0.2)]
FRAMES = 45


def stirred_beakers(bodies=("beaker", "rod", "second", "stirrer")):
    """A rod stirs in each of two beakers, or those of them that are asked for: at the wall now and then, else free."""
    meshes = {
        "beaker": revolved_mesh(WALL, 24),
        "rod": revolved_mesh(ROD, 8),
        "second": revolved_mesh(WALL, 21),
        "stirrer": revolved_mesh(ROD, 8),
    }
    meshes = {body: meshes[body] for body in bodies}
    axis = int(np.argmax(np.ptp(meshes["beaker"].vertices, axis=0)))
    side = (axis + 1) % 3
    frames = np.arange(FRAMES)
    positions = {body: np.zeros((FRAMES, 3)) for body in meshes}
    for rod in {"rod", "stirrer"} & meshes.keys():
        positions[rod][:, axis] = 0.05
        positions[rod][:, side] = np.where(frames % 15 < 3, 0.031, 0.001 * (frames % 15))
    for body in {"second", "stirrer"} & meshes.keys():
        positions[body][:, side] += 1.0
    still = np.tile([0.0, 0.0, 0.0, 1.0], (FRAMES, 1))
    poses = {body: (position, still) for body, position in positions.items()}
    data = {body: MeshData(mesh.vertices, mesh.faces) for body, mesh in meshes.items()}
    return Session.from_arrays(frames * STEP_NS, poses, data)


@pytest.fixture
def two_beakers():
    """Two beakers, each with a rod that stirs in it."""
    return stirred_beakers()


@pytest.fixture(scope="module")
def beaker_and_rod():
    """A rod that stirs in a beaker: half of the two, for tests in which one body is cut."""
    return stirred_beakers(("beaker", "rod"))


@pytest.fixture(scope="module")
def shared_beakers():
    """The same for all tests of a file, which leave it as it is."""
    return stirred_beakers()


@pytest.fixture
def missing_pieces(monkeypatch, two_beakers):
    """Pieces of the second beaker are a cube of a tenth of a millimetre: no false contact, and every contact missed."""
    data = two_beakers.meshes["second"]
    second = TriangleMesh(data.vertices, data.faces).content_hash
    tiny = trimesh.creation.box((1e-4, 1e-4, 1e-4))
    original = piece_store.convex_pieces

    def of_other_meshes(cut_ahead):
        """The function, of the cuts of all meshes but the second beaker's."""
        return lambda cuts, *limits, **named: cut_ahead(
            [cut for cut in cuts if cut.mesh.content_hash != second], *limits, **named
        )

    def planted(cut, *limits):
        if cut.most == 1 or cut.mesh.content_hash != second:
            return original(cut, *limits)
        return (TriangleMesh(tiny.vertices + 5.0, tiny.faces),)

    for module in (collider_search, compound):
        monkeypatch.setattr(module, "convex_pieces", planted)
    for module, name in ((collider_search, "cut_ahead"), (measured_fix, "cut_ahead"), (compound, "cut_all")):
        monkeypatch.setattr(module, name, of_other_meshes(getattr(module, name)))


@pytest.fixture(scope="package")
def bumped():
    """Two cubes that touch in three of twelve frames, and whose balls overlap in five more."""
    return unit_cubes_on_x({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})
