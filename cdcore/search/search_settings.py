"""Settings of the search: every constant of the colony has its name, default and range."""

from dataclasses import dataclass
from typing import Final

from cdcore.errors import InvalidSettingError
from cdcore.protocol.settings import MOST_WORK, CheckedSettings, choice, flag, number, whole

VARIANTS: Final = ("memetic", "corrected", "local", "random", "printed")
"""What may search: the colony with local search, the colony alone, two controls, and the equations as printed."""

EQUATIONS: Final = (15, 16, 17, 18, 19, 20)
MOST_WEIGHT: Final = 1000.0
"""Bound of angles, exponents and diameters."""


@dataclass(frozen=True, kw_only=True)
class SearchSettings(CheckedSettings):
    """Settings of one search for a face pair that meets.

    ``variant``: "memetic" (the corrected colony, its best ant improved by local search), "corrected" (the colony
    alone), "local" and "random" (controls without a colony), "printed" (the equations as printed, which break).
    ``ants``: population m. ``turn``: largest step theta0 of a rotation, radians. ``mutation``: probability of a NOT
    gate per qubit. ``alpha``, ``beta``: weights of pheromone and heuristic in (16). ``evaporation``: rho of (20).
    ``reward``: exponent of (19). ``pheromone_least``, ``pheromone_most``: clamp of tau. ``restart_after``: evaluations
    without a hit until the population is drawn anew.
    ``seed``: of all random streams. ``budget``: evaluations for one pair in one frame.
    ``samples``: faces of each body that are searched, drawn by area; ``None``: all.
    ``stop_first``: whether to stop at the first hit; else, where faces are asked for, the rest of the budget looks for
    further curves. ``warm_start``: whether a search starts at the closest pair of the frame before
    (never that of the equations as printed).
    ``rest``: in diameters of the mean face of the finer mesh, how far two bodies must have moved against each other
    since the whole budget found nothing before it is spent again; until then they get 192 evaluations from where they
    were closest, and none where they have moved by rounding only, as a thing that is held. 0: every frame gets the
    whole budget.
    ``without_equation``: one of 15 to 20, switched off: 15 one candidate per ant, straight from the angle; 16 every ant
    is followed with equal probability; 17 steps of the same size in a random direction; 18 no NOT gates; 19 no reward
    for improvement; 20 neither evaporation nor a deposit on the best.

    Source: section 3 of the project's specification; defaults from its sweep of 36 settings.
    """

    variant: str = choice("memetic", VARIANTS)
    ants: int = whole(20, 1, 10_000)
    turn: float = number(0.15 * 3.141592653589793, 0, MOST_WEIGHT)
    mutation: float = number(0.05, 0, 1)
    alpha: float = number(1.0, 0, MOST_WEIGHT)
    beta: float = number(3.0, 0, MOST_WEIGHT)
    evaporation: float = number(0.1, 0, 1)
    reward: float = number(1.0, 0, MOST_WEIGHT)
    pheromone_least: float = number(1e-3, 1e-300, 1e300)
    pheromone_most: float = number(10.0, 1e-300, 1e300)
    restart_after: int = whole(1500, 1, MOST_WORK)
    without_equation: int | None = choice(None, EQUATIONS)
    seed: int = whole(0, -(2**63), 2**63 - 1)
    budget: int = whole(2000, 1, MOST_WORK)
    samples: int | None = whole(None, 1, MOST_WORK)
    stop_first: bool = flag(True)
    warm_start: bool = flag(True)
    rest: float = number(0.0, 0, MOST_WEIGHT)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.pheromone_least > self.pheromone_most:
            raise InvalidSettingError(f"pheromone_least={self.pheromone_least} is too much; give up to pheromone_most")
