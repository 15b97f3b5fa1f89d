"""Settings of the search: every constant of the colony has its name, default and range."""

from dataclasses import dataclass
from typing import Final

from cdcore.errors import InvalidSettingError

VARIANTS: Final = ("memetic", "corrected", "local", "random", "printed")
"""What may search: the colony with local search, the colony alone, two controls, and the equations as printed."""

DECODERS: Final = ("angle", "amplitude")
EQUATIONS: Final = (15, 16, 17, 18, 19, 20)


@dataclass(frozen=True, kw_only=True)
class SearchSettings:
    """Settings of one search for a face pair that meets.

    ``variant``: "memetic" (the corrected colony, its best ant improved by local search), "corrected" (the colony
    alone), "local" and "random" (controls without a colony), "printed" (the equations as printed, which break).
    ``ants``: population m. ``turn``: largest step theta0 of a rotation, radians. ``mutation``: probability of a NOT
    gate per qubit. ``alpha``, ``beta``: weights of pheromone and heuristic in (16). ``evaporation``: rho of (20).
    ``reward``: exponent of (19). ``pheromone_least``, ``pheromone_most``: clamp of tau. ``restart_after``: evaluations
    without a hit until the population is drawn anew. ``decode``: "angle" (uniform over the faces) or "amplitude" (the
    literature's linear map, which draws the end faces twenty times too often).
    ``seed``: of all random streams. ``budget``: evaluations for one pair in one frame; an iteration of the colony is
    begun only within it. ``budget_seconds``: a budget in time instead, whose answers differ from run to run.
    ``samples``: faces of each body that are searched, drawn by area; ``None``: all. "auto": as many as the session so
    far advises, within ``frame_budget`` evaluations for all pairs of a frame together (``budget`` is then not used; one
    frame in 25 may take four times as many) and such that ``target_recall`` of what that budget would find is found.
    ``stop_first``: whether to stop at the first hit; else, where faces are asked for, the rest of the budget looks for
    further curves. ``warm_start``: whether a search starts at the closest pair of the frame before.
    ``rest``: in diameters of the mean face of the finer mesh, how far two bodies must have moved against each other
    since the whole budget found nothing before it is spent again; until then they get 192 evaluations from where they
    were closest, and none where they have moved by rounding only, as a thing that is held. 0: every frame gets the
    whole budget.
    ``without_equation``: one of 15 to 20, switched off: 15 one candidate per ant, straight from the angle; 16 every ant
    is followed with equal probability; 17 steps of the same size in a random direction; 18 no NOT gates; 19 no reward
    for improvement; 20 neither evaporation nor a deposit on the best.

    Source: section 3 of the project's specification; defaults from its sweep of 36 settings.
    """

    variant: str = "memetic"
    ants: int = 20
    turn: float = 0.15 * 3.141592653589793
    mutation: float = 0.05
    alpha: float = 1.0
    beta: float = 3.0
    evaporation: float = 0.1
    reward: float = 1.0
    pheromone_least: float = 1e-3
    pheromone_most: float = 10.0
    restart_after: int = 1500
    decode: str = "angle"
    without_equation: int | None = None
    seed: int = 0
    budget: int = 2000
    budget_seconds: float | None = None
    samples: int | str | None = None
    frame_budget: int = 4000
    target_recall: float = 0.99
    stop_first: bool = True
    warm_start: bool = True
    rest: float = 0.0

    def __post_init__(self) -> None:
        _require_one_of("variant", self.variant, VARIANTS)
        _require_one_of("decode", self.decode, DECODERS)
        _require_one_of("without_equation", self.without_equation, (None, *EQUATIONS))
        for name in ("ants", "restart_after", "budget", "frame_budget"):
            _require(name, getattr(self, name), 1, float("inf"), "a whole number of 1 or more")
        for name in ("mutation", "evaporation", "target_recall"):
            _require(name, getattr(self, name), 0.0, 1.0, "a number from 0 to 1")
        for name in ("turn", "alpha", "beta", "reward", "rest"):
            _require(name, getattr(self, name), 0.0, 1e3, "a number from 0 to 1000")
        self._require_samples()
        if self.budget_seconds is not None:
            _require("budget_seconds", self.budget_seconds, 1e-9, 1e9, "seconds above 0, or None")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int):
            raise InvalidSettingError(f"seed={self.seed!r} is no whole number; give one")
        _require("pheromone_most", self.pheromone_most, 1e-300, 1e300, "a number above 0")
        _require("pheromone_least", self.pheromone_least, 1e-300, self.pheromone_most, "above 0, up to pheromone_most")

    def _require_samples(self) -> None:
        if self.samples == "auto":
            if self.budget_seconds is not None:
                raise InvalidSettingError("samples='auto' has its budget in frame_budget; leave budget_seconds out")
            if not self.stop_first:
                raise InvalidSettingError("samples='auto' stops at the first hit; leave stop_first=False out")
        elif self.samples is not None:
            _require("samples", self.samples, 1, float("inf"), 'a whole number of 1 or more, "auto" or None')


def _require_one_of(name: str, value: object, allowed: tuple[object, ...]) -> None:
    if value not in allowed:
        known = ", ".join(str(one) for one in allowed if one is not None)
        raise InvalidSettingError(f"{name}={value!r} is not known; choose one of: {known}")


def _require(name: str, value: object, low: float, high: float, wanted: str) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise InvalidSettingError(f"{name}={value!r} is out of range; give {wanted}")
    if isinstance(low, int) and not isinstance(value, int):
        raise InvalidSettingError(f"{name}={value!r} is out of range; give {wanted}")
