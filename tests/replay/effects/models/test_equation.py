import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.equation import approach, atoms, equation_of


@pytest.mark.parametrize(
    ("formula", "counts"),
    [("NaCl", {"Na": 1, "Cl": 1}), ("Ca(OH)2", {"Ca": 1, "O": 2, "H": 2}),
     ("CuSO4.5H2O", {"Cu": 1, "S": 1, "O": 9, "H": 10}), ("Al2(SO4)3", {"Al": 2, "S": 3, "O": 12})],
)  # fmt: skip
def test_atoms_are_counted(formula, counts):
    assert dict(atoms(formula)) == counts


@pytest.mark.parametrize("formula", ["", "nacl", "Na(", "Na)", "Na+", "()"])
def test_what_is_no_formula_is_refused(formula):
    with pytest.raises(ValueError, match="formula"):
        atoms(formula)


def test_an_equation_has_two_balanced_sides():
    equation = equation_of("Zn + 2 HCl -> ZnCl2 + H2")
    assert equation.reagents == {"Zn": 1, "HCl": 2} and equation.products == {"ZnCl2": 1, "H2": 1}
    with pytest.raises(ValueError, match="not balanced: Cl 1 and 2, H 1 and 2"):
        equation_of("Zn + HCl -> ZnCl2 + H2")
    with pytest.raises(ValueError, match="has no ->"):
        equation_of("Zn + 2 HCl = ZnCl2 + H2")
    with pytest.raises(ValueError, match="coefficient 0"):
        equation_of("0 Zn -> 0 Zn")


def test_it_goes_to_the_end_of_the_limiting_reagent():
    equation = equation_of("Zn + 2 HCl -> ZnCl2 + H2")
    amounts = {"Zn": np.array([1.0, 1.0, 0.0, 1.0]), "HCl": np.array([1.0, 4.0, 1.0, 0.0])}
    assert equation.extent(amounts).tolist() == [0.5, 1.0, 0.0, 0.0]


@given(st.lists(st.floats(1e-6, 1e4), min_size=2, max_size=20), st.floats(1e-6, 1e3))
def test_a_first_order_approach_is_its_closed_form_however_it_is_cut(steps, rate):
    times = np.concatenate([[0.0], np.cumsum(steps)])
    reached = approach(times, np.full(len(times), 2.0), rate)
    assert reached[-1] == pytest.approx(-2.0 * np.expm1(-rate * times[-1]), rel=1e-9)
    assert (np.diff(reached) >= 0.0).all() and reached.max() <= 2.0


def test_a_goal_that_sinks_below_what_has_happened_undoes_nothing():
    assert approach(np.array([0.0, 10.0, 20.0]), np.array([1.0, 0.1, 0.1]), 1.0)[-1] == pytest.approx(1.0, rel=1e-4)
