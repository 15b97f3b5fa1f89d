import numpy as np
import pytest
import trimesh
from support.second_opinions import distances_along_rays, points_on_faces

from sessions.glassware.catalogue import made_instrument as make_instrument

SIZES = [500, *(pytest.param(faces, marks=pytest.mark.slow) for faces in (2000, 5000, 50_000))]
BEAKERS = [f"beaker_{millilitres}" for millilitres in (50, 100, 250, 400, 600)]
FLASKS = ["erlenmeyer_flask", "volumetric_flask", "reagent_bottle", "alcohol_lamp"]
TUBES = ["test_tube", "graduated_cylinder", "funnel", "burette", "pipette", "dropper", "gas_jar"]
VESSELS = [*BEAKERS, *FLASKS, *TUBES, "watch_glass", "evaporating_dish"]
INSIDE = 1e-4
RAYS = 120
HEIGHTS, ROTATIONS = 32, 31
FEET = {"graduated_cylinder": 17e-3}  # Below, a foot stands in place of the wall


def wall_thicknesses(instrument, seed):
    """Shoot from inside the cavity at right angles through the glass; near openings and feet there is no plain wall."""
    cavity = instrument.cavity
    points, normals = points_on_faces(cavity.to_brim, RAYS, seed)
    ends = [cavity.opening.centre[1]] + ([cavity.floor_height] if "drains" in instrument.tags else [])
    clear = np.min([np.abs(points[:, 1] - end) for end in ends], axis=0) > 4e-3
    clear &= points[:, 1] >= FEET.get(instrument.name, -1.0)
    points, normals = points[clear], normals[clear]
    hits = distances_along_rays(instrument.mesh.triangles, points - INSIDE * normals, normals)
    through = [hit for hit in hits if len(hit) > 1 and abs(hit[0] - INSIDE) < 2e-6]
    assert len(through) > 0.9 * len(points) > 0.25 * RAYS
    return np.array([hit[1] - hit[0] for hit in through])


@pytest.mark.sampled(3)
@pytest.mark.parametrize("faces", SIZES)
@pytest.mark.parametrize("name", VESSELS)
def test_wall_is_uniform_and_about_1_to_2_mm_thick(name, faces):
    """120 rays go through a vessel's glass at right angles, away from openings and feet; walls are made 1 to 2.2 mm.

    Measured they are 0.8 to 2.5 mm in the median, and nowhere further than 10 % from the middle of least and most.
    """
    walls_m = wall_thicknesses(make_instrument(name, faces), seed=faces)
    assert 0.0008 <= np.median(walls_m) <= 0.0025
    assert walls_m == pytest.approx((walls_m.min() + walls_m.max()) / 2, rel=0.10)


@pytest.mark.sampled(18)
@pytest.mark.parametrize("name", VESSELS)
def test_the_glass_itself_encloses_the_capacity(name):
    """The volume of a vessel is measured by rays from its axis to the glass, at 32 heights between floor and mark.

    At each height 31 rays give the mean square of the radius, and so the area. It is the nominal volume within 1 %.
    """
    instrument = make_instrument(name, 500)
    cavity = instrument.cavity
    heights = np.linspace(cavity.floor_height, cavity.mark_height, 2 * HEIGHTS + 1)[1::2]
    rotations = np.linspace(0, 2 * np.pi, ROTATIONS, endpoint=False) + 0.0123  # any offset that meets no edge
    outward = np.column_stack([np.cos(rotations), np.zeros(ROTATIONS), np.sin(rotations)])
    origins = np.array([[0, y, 0] for y in heights for _ in rotations])
    hits = distances_along_rays(instrument.mesh.triangles, origins, np.tile(outward, (HEIGHTS, 1)))
    mean_square = np.mean([hit[0] ** 2 for hit in hits])
    volume_m3 = np.pi * mean_square * (cavity.mark_height - cavity.floor_height)
    assert volume_m3 == pytest.approx(cavity.capacity_m3, rel=0.01)


OUTLINES = ("beaker_50", "volumetric_flask", "graduated_cylinder", "funnel", "pipette", "watch_glass")
"""A vessel of each outline; the cylinder has the foot with six sides."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name not in OUTLINES)) for name in VESSELS]
)
def test_glass_bends_by_little_more_than_90_degrees(name):
    """Neighbouring faces of a vessel differ by 1.7 rad, 97 degrees, at most; a wall that folds back has more."""
    mesh = make_instrument(name, faces=2000).mesh
    angles_rad = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).face_adjacency_angles
    assert angles_rad.max() < 1.7
