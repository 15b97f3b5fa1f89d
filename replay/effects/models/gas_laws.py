"""Room that a gas takes, dry or over water."""

from typing import Final

GAS_CONSTANT: Final = 8.314462618
"""J/(mol K), exact. Source: CODATA 2018, from the SI of 2019."""

KELVIN: Final = 273.15

MMHG_PA: Final = 133.322
"""Source: NIST SP 811, appendix B."""


def vapour_pressure_pa(celsius: float, antoine: tuple[float, float, float]) -> float:
    """Pressure of saturated vapour: log10(P / mmHg) = A - B / (C + T / degC).

    Raises ValueError: the temperature is at or below the pole of the formula, -C.
    """
    a, b, c = antoine
    if c + celsius <= 0.0:
        raise ValueError(f"Antoine's formula has no value at {celsius:g} degC with C = {c:g}; check its constants")
    return float(MMHG_PA * 10.0 ** (a - b / (c + celsius)))


def gas_ml_per_mol(celsius: float, pressure_pa: float, vapour_pa: float = 0.0) -> float:
    """Millilitres of one mol of an ideal gas at a pressure of which vapour takes a part.

    Raises ValueError: the vapour's pressure reaches the whole, or it is colder than absolute zero.
    """
    if celsius <= -KELVIN or pressure_pa <= vapour_pa:
        raise ValueError(
            f"no gas is collected at {celsius:g} degC and {pressure_pa:g} Pa with {vapour_pa:g} Pa of vapour; "
            "give a temperature above absolute zero and a pressure above that of the vapour"
        )
    return GAS_CONSTANT * (celsius + KELVIN) / (pressure_pa - vapour_pa) * 1e6
