"""Volumes that vessels keep, beside slices of the same meshes by another library."""

import math

import numpy as np
import pytest
from manifold3d import Manifold, Mesh
from support.small_worlds import cube

from replay.effects.models.sliced import SlicedCavity, volume_kept
from sessions.glassware.catalogue import made_instrument as make_instrument

FACES = 500
VESSELS = (
    "beaker_50", "beaker_100", "beaker_250", "beaker_400", "beaker_600", "erlenmeyer_flask", "volumetric_flask",
    "reagent_bottle", "test_tube", "graduated_cylinder", "funnel", "burette", "pipette", "dropper", "watch_glass",
    "evaporating_dish", "gas_jar", "alcohol_lamp",
)  # fmt: skip
SIDES = np.radians(np.arange(8) * 45.0 + 7.0)
FILLS = (0.25, 0.5, 1.0)


def gravity_when_tilted(tilt, side):
    """Gravity (3,) in the frame of a vessel tilted by so many radians to a side."""
    return np.array([math.sin(tilt) * math.cos(side), -math.cos(tilt), math.sin(tilt) * math.sin(side)])


def sliced(mesh, opening, normal=(0.0, 1.0, 0.0)):
    """The cavity of a vessel with an opening."""
    return SlicedCavity(mesh.vertices, mesh.faces, np.array(opening), np.array(normal))


def solid_of(mesh):
    """The mesh as manifold3d has it."""
    return Manifold(Mesh(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)))


@pytest.mark.sampled(18)
@pytest.mark.parametrize("name", VESSELS)
def test_onset_and_volume_agree_with_slices_of_another_library(name):
    """A vessel is tilted by 0 to 180 degrees in steps of 0.1 to each of eight sides, filled to 1/4, 1/2 and the whole.

    The tilt at which it begins to pour is right within half a degree, and the volume that it keeps there within 2 %, by
    manifold3d, which cuts the same mesh of its cavity by the plane through the lowest point of the rim. Tilts are
    counted from where the opening looks up: a dropper, which opens downwards, is turned over.
    """
    cavity = make_instrument(name, FACES).cavity
    mesh, tilts, upright = cavity.to_brim, np.arange(0.0, 180.0, 0.1), np.array([1.0, cavity.opening.normal[1], 1.0])
    shape, solid = sliced(mesh, cavity.opening.centre, cavity.opening.normal), solid_of(mesh)
    heights = mesh.vertices @ np.array(cavity.opening.normal)
    rim = mesh.vertices[heights == heights.max()]

    def expected_ml(degrees, side):
        gravity = upright * gravity_when_tilted(math.radians(max(degrees, 0.0)), side)
        return solid.trim_by_plane(gravity, float((rim @ gravity).max())).volume() * 1e6

    for side in SIDES:
        kept_ml = shape.kept_ml(np.array([upright * gravity_when_tilted(tilt, side) for tilt in np.radians(tilts)]))
        for fill in FILLS:
            filled_ml = fill * cavity.capacity_m3 * 1e6
            first = int(np.argmax(kept_ml <= filled_ml))
            assert expected_ml(tilts[first] - 0.5, side) >= filled_ml >= expected_ml(tilts[first] + 0.5, side)
            assert kept_ml[first] == pytest.approx(expected_ml(tilts[first], side), rel=0.02)


def test_box_keeps_what_its_lowest_rim_holds():
    """A full box of 10 cm, a litre, open at its top, is tilted by ``degrees`` towards ``side_degrees`` about its axis.

    Towards 0 its lowest rim is an edge, else a corner. It keeps what is not above the level of its lowest rim.
    """
    for case, (degrees, side_degrees, kept_ml) in {
        "upright": (0.0, 0.0, 1000.0),
        "half below its diagonal": (45.0, 0.0, 500.0),
        # The level is on average tan(10.3) (cos(20.7) + sin(20.7)) 5 cm = 1.171 cm below the rim, on 100 cm2.
        "over a corner": (10.3, 20.7, 1000.0 - 117.1),
        "overturned": (180.0, 0.0, 0.0),
    }.items():
        cavity = sliced(cube(edge=0.1), opening=(0.0, 0.05, 0.0))
        down = gravity_when_tilted(math.radians(degrees), math.radians(side_degrees))
        assert cavity.kept_ml(down[None]) == pytest.approx([kept_ml], abs=1.0), case


def test_level_of_a_box_rises_with_its_volume():
    """A box of 10 cm about the origin: of its litre 250 mL stand 2.5 cm high."""
    cavity = sliced(cube(edge=0.1), opening=(0.0, 0.05, 0.0))
    millilitres = np.array([0.0, 250.0, 1000.0])
    assert cavity.level(millilitres) == pytest.approx([-0.05, -0.025, 0.05])


RADIUS, HEIGHT = 0.03, 0.08
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)


def volume_by_integral(tilt, radius, height):
    """Columns of liquid over the floor, summed: no formula of the module, and no difference of nearly equal numbers.

    A column at distance u from the wall below the lip is ``height - u tan(tilt)`` high and ``2 sqrt(u (2R - u))`` wide;
    with u = 2 R sin^2(a / 2) both are smooth in a.
    """
    slope = math.tan(tilt)
    reach = height / slope if slope > 0.0 else math.inf
    last = math.pi if reach >= 2 * radius else 2 * math.asin(math.sqrt(reach / (2 * radius)))
    angle = 0.5 * last * (NODES + 1.0)
    column = height - 2.0 * radius * np.sin(angle / 2) ** 2 * slope
    if last < math.pi:
        column = 2.0 * radius * slope * np.sin((last - angle) / 2) * np.sin((last + angle) / 2)
    return float(0.5 * last * np.sum(WEIGHTS * 2.0 * radius**2 * np.sin(angle) ** 2 * column))


TILTS = [1e-9, 0.1, 10, 50, 53, 53.13, 54, 70, 80, 85, 89, 89.9, 89.99, 89.9999, 90 - 1e-6, 90 - 1e-8, 90 - 1e-9]


def test_the_kept_volume_is_the_integral():
    """A cylinder, upright at 0 and lying at 90 degrees, keeps what is below its rim; its radius and height in metres.

    The expected volume is a numerical integral over columns of liquid that stand on its floor.
    """
    for radius, height in [(0.03, 0.08), (0.04, 0.006), (0.004, 0.2)]:
        for degrees in TILTS:
            tilt = math.radians(degrees)
            volume = volume_by_integral(tilt, radius, height)
            kept = volume_kept(tilt, radius, height)
            assert kept == pytest.approx(volume, rel=1e-9, abs=0), (radius, height, degrees)
