"""Room that a gas takes, dry or over water."""

from collections.abc import Sequence
from typing import Final

GAS_CONSTANT: Final = 8.314462618
"""J/(mol K), exact. Source: CODATA 2018, from the SI of 2019."""

KELVIN: Final = 273.15

MMHG_PA: Final = 133.322
"""Source: NIST SP 811, appendix B."""


def gas_ml_per_mol(celsius: float, pressure_pa: float, antoine: Sequence[float] | None = None) -> float:
    """Millilitres of one mol of an ideal gas; ``antoine``: A, B and C of water, where it is collected over water.

    Saturated vapour takes its part of the pressure: log10(P / mmHg) = A - B / (C + T / degC).

    Raises ValueError: at that temperature the formula has no value, or the vapour's pressure reaches the whole.
    """
    vapour_pa = 0.0
    if antoine is not None:
        a, b, c = antoine
        if c + celsius <= 0.0:
            raise ValueError(f"Antoine's formula has no value at {celsius:g} degC with C = {c:g}; check its constants")
        vapour_pa = MMHG_PA * 10.0 ** (a - b / (c + celsius))
    if pressure_pa <= vapour_pa:
        raise ValueError(
            f"no gas is collected at {celsius:g} degC and {pressure_pa:g} Pa with {vapour_pa:g} Pa of vapour; "
            "give a pressure above that of the vapour"
        )
    return GAS_CONSTANT * (celsius + KELVIN) / (pressure_pa - vapour_pa) * 1e6
