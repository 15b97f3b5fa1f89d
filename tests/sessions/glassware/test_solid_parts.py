import numpy as np
import pytest

from sessions.geometry.solids import box
from sessions.glassware.instrument import DENSITY, Instrument, Part, mass_of
from sessions.glassware.solid_parts import (
    bent,
    cylinder,
    fitted,
    fitted_union,
    grounded,
    ring,
    rod,
    sections_for,
    swept,
)
from sessions.mesh_data import is_closed


def test_box_cylinder_rod_and_ring_have_their_volumes():
    solids = {
        "box": (box((1, 2, 3), (5, 6, 7)), 6.0),
        "cylinder": (cylinder((0, 0, 0), (1, 2, 2), 0.1, 16), np.pi * 0.01 * 3),
        "cone": (cylinder((0, 0, 0), (0, 3, 0), 0.2, 16, end_radius=0.1), np.pi * (0.04 + 0.02 + 0.01)),
        "rod": (rod([(0, 0, 0), (0, 0, 3)], 0.1, 64), np.pi * 0.01 * 3 + 4 / 3 * np.pi * 0.001),
        "ring": (ring([(1.0, 0.0), (1.1, 0.0), (1.1, 0.2), (1.0, 0.2)], 64), np.pi * (1.21 - 1.0) * 0.2),
    }
    for name, (solid, volume) in solids.items():
        assert is_closed(solid), name
        assert solid.volume == pytest.approx(volume, rel=2e-3), name


def test_a_bent_path_keeps_its_ends_and_turns_with_the_radius():
    path = bent([(0, 0, 0), (0, 1, 0), (1, 1, 0)], 0.2, 0.01)
    assert path[0].tolist() == [0, 0, 0]
    assert path[-1].tolist() == [1, 1, 0]
    bend = path[1:-1]
    assert np.linalg.norm(bend - [0.2, 0.8, 0], axis=1) == pytest.approx(0.2)
    assert np.diff(path, axis=0)[:, 2].tolist() == [0.0] * (len(path) - 1)


def test_circles_along_a_bend_do_not_twist():
    path = bent([(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 1, 1)], 0.2, 0.05)
    rings = swept(path, [0.05] * len(path), 12)
    spokes = np.array([circle[0] - point for circle, point in zip(rings, path, strict=True)])
    cosines = np.einsum("ij,ij->i", spokes[1:], spokes[:-1]) / np.linalg.norm(spokes[0]) ** 2
    assert cosines.min() > 0.9


@pytest.mark.parametrize("faces", [100, 800, 6000])
def test_a_fitted_union_has_about_the_faces_asked_for(faces):
    def parts(spacing):
        around = sections_for(0.02, spacing)
        return [box((0.1, 0.02, 0.1), (0, 0, 0)), cylinder((0, 0, 0), (0, 0.2, 0), 0.02, around)]

    mesh = fitted_union(parts, faces, 0.02)
    assert is_closed(mesh)
    assert len(mesh.faces) == pytest.approx(faces, rel=0.15)
    assert mesh.volume == pytest.approx(0.0002 + np.pi * 0.02**2 * 0.19, rel=1e-4)


def test_the_search_returns_the_nearest_count_when_none_is_near():
    coarse, fine = cylinder((0, 0, 0), (0, 1, 0), 1, 5), cylinder((0, 0, 0), (0, 1, 0), 1, 500)
    counts = [len(fitted(lambda s: fine if s < 0.1 else coarse, faces, 1.0)[0].faces) for faces in (30, 1500)]
    assert counts == [len(coarse.faces), len(fine.faces)]


def test_grounded_stands_on_the_plane():
    assert grounded(box((1, 1, 1), (3, 7, 2))).bounds[:, 1].tolist() == [0, 1]


def test_a_part_at_rest_is_moved_by_its_position():
    mesh = box((0.1, 0.1, 0.1), (0, 0, 0))
    part = Part(
        instrument=Instrument(name="x", mesh=mesh, tags=(), material="steel", sources=(), mass=1.0), position=(1, 2, 3)
    )
    assert (part.to_parent @ [0, 0, 0, 1]).tolist() == [1, 2, 3, 1]
    assert np.array_equal(part.to_parent[:3, :3], np.eye(3))


@pytest.mark.parametrize("material", DENSITY)
def test_mass_is_volume_times_density(material):
    assert mass_of(box((0.1, 0.2, 0.5), (0, 0, 0)), material) == pytest.approx(0.01 * DENSITY[material])


def test_borosilicate_glass_has_the_density_of_its_standard():
    assert DENSITY["borosilicate glass 3.3"] == 2230.0  # ISO 3585: 2.23 g/cm3
