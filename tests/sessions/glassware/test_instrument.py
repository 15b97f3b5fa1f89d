import numpy as np
import pytest

from sessions.geometry.solids import box
from sessions.glassware.instrument import DENSITY, Instrument, Part, mass_of


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
