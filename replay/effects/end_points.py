"""End points of a titration: where acid and base, or oxidant and reductant, are equivalent.

What is equivalent follows from the amounts alone: the excess of protons over all steps of pKa above a cut changes its
sign. Only a cut at which the pH has an inflection is an end point: nobody could see the others.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, combinations, pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay import words
from replay.effects.chemistry.components import METALS, PROTON, WATER, dissolved_components, solute_components
from replay.effects.chemistry.ledger_columns import ADDED_SUFFIX, WITHOUT_HEAT_C
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID, Mixture
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.solver import Solver
from replay.effects.equivalence import Equivalence
from replay.effects.output import EffectEvent
from replay.effects.titrated_concentration import titrated_concentration

LEAST_EXCESS_FRACTION: Final = 1e-6
"""An excess below this share of the greatest there was is none: what a slow reaction leaves ends no titration."""

STEEPNESS_RATIO: Final = 1.5
"""An inflection is so many times steeper than the curve on either side; at half a step there a buffer is flattest."""

HALF_STEP_FRACTIONS: Final = np.linspace(-0.5, 0.5, 42)
"""Shares of the smaller step next to a cut at which the pH is asked for; none is the cut itself."""

INFLECTION_TOLERANCE: Final = 0.15
"""An inflection further from the cut, as a share of that step, is none of it."""

STRONGEST, WEAKEST = -2.0, 16.0
"""A pKa beyond these is no step: the acid gives its proton whole, or keeps it in water."""


@dataclass(frozen=True)
class _Crossing:
    """A change of sign of an excess: between two rows of a history, by a straight line."""

    row_before: int
    row_after: int
    fraction: float
    rising: bool

    def interpolate(self, rows: FloatArray) -> FloatArray:
        """Interpolates rows (n, ...) at the crossing."""
        return rows[self.row_before] + self.fraction * (rows[self.row_after] - rows[self.row_before])


@dataclass(frozen=True)
class _Equivalent:
    """Two reagents that are equivalent at a crossing, and the share of them that has reacted."""

    crossing: _Crossing
    kind: Equivalence
    left: str
    right: str
    reacted: float = 1.0


Crossings = Iterator[_Equivalent]

CrossingFinder = Callable[[FloatArray], Iterator[_Crossing]]
"""Finds the crossings of an excess (n,) over the rows of a history."""

UNREACHED_RATIO: Final = 1.25
"""Share of what has run in up to which an end point that was not reached is said; chosen by us."""

LEAST_REACTED_FRACTION: Final = 0.9
"""Share of two equivalent reagents that must have reacted for an end point: an indicator or a colour shows it then."""

LEAST_REPORTED_FRACTION: Final = 1e-4
"""The same of reagents that are said not to have reacted; of less the equation says that it does not proceed."""

LEAST_REACTED_BESIDE_PARTNER: Final = 0.99
"""The same where another partner of the ion is there: calcium beside magnesium shows no end point of its own."""

COARSE_STEP_ML: Final = 0.5
COARSE_STEP_FRACTION: Final = 0.02
"""A step of more than both, the second of all that came: where gas leaves or another equation runs in such a step as
well, what remains is no straight line over the step, and an end point within is not known."""

MOST_PARTNERS: Final = 4
"""Partners of an ion that may be equivalent to it together."""


def end_points(matter: Matter, vessel: str) -> list[EffectEvent]:
    """Events in order of what came in, with its volume, what overshot it, and whose it is.

    The volume is that which came from where the flow came from that did it: the titrant, rinses left out.
    """
    events = _events(matter, vessel, _acid_and_redox_points(matter, vessel, _zero_crossings))
    return events or list(_unreached_event(matter, vessel))


def _acid_and_redox_points(matter: Matter, vessel: str, find_crossings: CrossingFinder) -> Crossings:
    component_totals = matter.totals(matter.histories[vessel].amounts)
    return chain(
        _acid_base_points(matter, vessel, component_totals, find_crossings),
        _redox_points(matter, vessel, find_crossings),
    )


def _unreached_event(matter: Matter, vessel: str) -> Iterator[EffectEvent]:
    """Event of the nearest end point at which a titration had not arrived when its titrant ended."""
    history = matter.histories[vessel]
    growing_rows = np.flatnonzero(np.diff(history.added_ml, axis=0).any(axis=1))
    if not len(growing_rows):
        return
    last_row = int(growing_rows[-1]) + 1
    is_source = history.added_ml[last_row] > history.added_ml[last_row - 1]
    added_volume = history.added_ml[:, is_source].sum(axis=1)
    is_titrant_only = (history.added_ml[:, ~is_source] == history.added_ml[last_row, ~is_source]).all(axis=1)
    row_before = int(np.argmax(is_titrant_only & (added_volume >= 0.5 * added_volume[last_row])))
    sources = [name for name, index in matter.ledger.at.items() if name and is_source[index]]

    def crossings_ahead(excess: FloatArray) -> Iterator[_Crossing]:
        first, last = float(excess[row_before]), float(excess[last_row])
        is_nearer = abs(last) < abs(first) and first * last > 0.0
        if is_nearer and abs(last) > LEAST_EXCESS_FRACTION * np.abs(excess).max():
            yield _Crossing(row_before, last_row, first / (first - last), last > first)

    ends = sorted(
        (float(point.crossing.interpolate(added_volume)), point.left, point.right)
        for point in _acid_and_redox_points(matter, vessel, crossings_ahead)
        if point.reacted >= LEAST_REACTED_FRACTION
        and point.crossing.interpolate(added_volume) <= UNREACHED_RATIO * added_volume[last_row]
    )
    if len(sources) == 1 and ends and row_before < last_row:
        volume, left, right = ends[0]
        message = (
            f"{words.decimal(float(added_volume[last_row]), 2)} mL of {sources[0]} came into {vessel}; the end "
            f"point of {left} "
            f"and {right} would be at {words.decimal(volume, 2)} mL"
        )
        values: dict[str, float | str] = {"volume_ml": volume, "came_ml": float(added_volume[last_row])}
        yield EffectEvent(float(history.times[last_row]), "not-reached", (vessel,), None, values, message)


def ion_end_points(matter: Matter, vessel: str) -> list[EffectEvent]:
    """Events of a metal and an anion that are equivalent where they make a solid or a complex."""
    return _events(
        matter, vessel, _metal_and_anion_points(matter, vessel, matter.totals(matter.histories[vessel].amounts))
    )


def titrated_metals(matter: Matter, vessel: str) -> set[str]:
    """Metals of a vessel that an anion titrated, or that titrated one."""
    if not matter.histories[vessel].added_ml[-1].any():
        return set()
    totals = matter.totals(matter.histories[vessel].amounts)
    points = _metal_and_anion_points(matter, vessel, totals)
    return {name for point in points for side in (point.left, point.right) for name in side.split(" + ")} & METALS


def _events(matter: Matter, vessel: str, kinds: Crossings) -> list[EffectEvent]:
    history = matter.histories[vessel]
    if not history.added_ml[-1].any():
        return []
    # In the order in which events are listed, so that numbers of end points at one time rise.
    equivalents = sorted(kinds, key=lambda point: (_time_of(point.crossing, history.times), point.left))
    coarse_points = [point for point in equivalents if _is_coarse(matter, vessel, point)]
    equivalents = [point for point in equivalents if point not in coarse_points]
    # What comes to pass while nothing flows in, as in an iodine clock, is no end point of a titration.
    points = [
        point
        for point in equivalents
        if point.reacted >= LEAST_REACTED_FRACTION
        and (history.added_ml[point.crossing.row_after] > history.added_ml[point.crossing.row_before]).any()
    ]
    events = [
        _incomplete_event(matter, vessel, point)
        for point in equivalents
        if LEAST_REPORTED_FRACTION <= point.reacted < LEAST_REACTED_FRACTION
    ]
    events += [
        _end_point_event(matter, vessel, point, number, len(points)) for number, point in enumerate(points, start=1)
    ]
    coarse_events = [_coarse_event(matter, vessel, point) for point in coarse_points]
    return events + list({event.text: event for event in coarse_events}.values())


def _added_in_step(matter: Matter, vessel: str, crossing: _Crossing) -> tuple[float, float]:
    """mL that had come before and after the step of a crossing, from where its flow came."""
    history = matter.histories[vessel]
    is_source = history.added_ml[crossing.row_after] > history.added_ml[crossing.row_before]
    before, after = history.added_ml[[crossing.row_before, crossing.row_after]][:, is_source].sum(axis=1)
    return float(before), float(after)


def _is_coarse(matter: Matter, vessel: str, point: _Equivalent) -> bool:
    """Whether much came in the step of a crossing, and gas left or another equation ran in the step as well."""
    history, rows = matter.histories[vessel], [point.crossing.row_before, point.crossing.row_after]
    before, after = _added_in_step(matter, vessel, point.crossing)
    if after - before <= max(COARSE_STEP_ML, COARSE_STEP_FRACTION * after):
        return False
    gases = [index for name, index in matter.ledger.column.items() if name.endswith(GAS)]
    other_rows = [
        row
        for row, process in enumerate(matter.recipe.processes)
        if {point.left, point.right} != {matter.recipe.reagent(row, column) for column in _redox_reagents(process)}
    ]
    changes = np.concatenate(
        [np.diff(history.amounts[rows][:, gases], axis=0), np.diff(history.extents[rows][:, other_rows], axis=0)],
        axis=1,
    )
    return bool(changes.any())


def _coarse_event(matter: Matter, vessel: str, point: _Equivalent) -> EffectEvent:
    """Event of an end point within so much that came at once that nobody could tell where."""
    before, after = _added_in_step(matter, vessel, point.crossing)
    message = (
        f"{point.left} and {point.right} are equivalent in {vessel} somewhere between {words.decimal(before, 2)} and "
        f"{words.decimal(after, 2)} mL, which came at once"
    )
    time = float(matter.histories[vessel].times[point.crossing.row_after])
    values: dict[str, float | str] = {"from_ml": before, "to_ml": after, "of": point.kind.value}
    return EffectEvent(time, "passed", (vessel,), None, values, message)


def _time_of(crossing: _Crossing, times: FloatArray) -> float:
    """Seconds of a crossing, to the nanosecond: libraries differ in the last bits, and with them the order of ties."""
    return round(float(crossing.interpolate(times)), 9)


def _incomplete_event(matter: Matter, vessel: str, point: _Equivalent) -> EffectEvent:
    """Event of reagents that are equivalent before they have reacted: a slow reaction."""
    history, crossing = matter.histories[vessel], point.crossing
    is_source = history.added_ml[crossing.row_after] > history.added_ml[crossing.row_before]
    volume = float(crossing.interpolate(history.added_ml[:, is_source].sum(axis=1)))
    after = f" after {words.decimal(volume, 2)} mL" if is_source.any() else ""
    message = (
        f"{point.left} and {point.right} are equivalent in {vessel}{after}, but "
        f"{words.as_percentage(point.reacted)} of them have reacted: no end point"
    )
    time = _time_of(point.crossing, matter.histories[vessel].times)
    return EffectEvent(time, "incomplete", (vessel,), None, {"reacted": point.reacted}, message, "warning")


def _end_point_event(matter: Matter, vessel: str, point: _Equivalent, number: int, count: int) -> EffectEvent:
    """Event of an end point: its volume, the concentration that it gives, and after the last what overshot it."""
    history, crossing = matter.histories[vessel], point.crossing
    is_source = history.added_ml[crossing.row_after] > history.added_ml[crossing.row_before]
    added_volume = history.added_ml[:, is_source].sum(axis=1)
    volume = float(crossing.interpolate(added_volume))
    overshoot_ml = float(added_volume[-1]) - volume
    sources = [name for name, index in matter.ledger.at.items() if name and is_source[index]]
    concentration, values = "", dict[str, float | str]()
    if len(sources) == 1 and _is_plain_titration(matter, vessel, crossing, sources[0]):
        concentration, values = titrated_concentration(
            matter.recipe.contents, vessel, sources[0], (point.left, point.right), volume
        )
    message = f"{point.left} and {point.right} are equivalent in {vessel} after {words.decimal(volume, 2)} mL"
    if count > 1:
        message += f" (end point {number} of {count})"
    message += concentration
    if number == count:
        message += f"; overshot by {words.decimal(overshoot_ml, 2)} mL"
    values |= {"volume_ml": volume, "overshot_ml": overshoot_ml, "number": number, "of": point.kind.value}
    return EffectEvent(_time_of(crossing, history.times), "end-point", (vessel,), None, values, message)


def _is_plain_titration(matter: Matter, vessel: str, crossing: _Crossing, titrant: str) -> bool:
    """Whether the titrant is all dissolved, and all else that came until a crossing was water."""
    solids = [name for name in matter.ledger.column if name.endswith(SOLID)]
    if any(matter.amount(titrant, name).any() for name in solids):
        return False
    added_at_crossing = matter.histories[vessel].added_ml[crossing.row_after]
    other_sources = [
        name for name, index in matter.ledger.at.items() if name not in (titrant, "") and added_at_crossing[index] > 0.0
    ]
    contents = matter.recipe.contents
    return all(name in contents and set(contents[name].amounts) <= {WATER} for name in other_sources)


def _acid_base_points(matter: Matter, vessel: str, totals: FloatArray, find_crossings: CrossingFinder) -> Crossings:
    solver = matter.solver
    if solver is None:
        return
    mixture = solver.mixture
    water = matter.amount(vessel, WATER)
    excess_protons = totals.copy()
    # Protons are counted above the barest form of each part.
    excess_protons[:, 0] -= totals[:, 1:] @ np.array(
        [mixture.least_protons(component) for component in mixture.components[1:]]
    )
    pka_by_component = [()] + [
        mixture.pka(component) if amount.any() else ()
        for component, amount in zip(mixture.components[1:], totals.T[1:], strict=True)
    ]
    pka_bounds = [
        -np.inf,
        *sorted({step for steps in pka_by_component for step in steps if STRONGEST < step < WEAKEST}),
        np.inf,
    ]
    for lower, upper in pairwise(pka_bounds):
        excess = excess_protons[:, 0] - totals @ np.array(
            [sum(step >= upper for step in steps) for steps in pka_by_component]
        )
        for crossing in find_crossings(excess):
            point = crossing.interpolate(totals)
            sizes = [
                float(point @ [pka_bound in steps for steps in pka_by_component])
                for pka_bound in (lower, upper)
                if np.isfinite(pka_bound)
            ]
            size = min(sizes, default=float(np.abs(excess).max()))
            water_mol = float(crossing.interpolate(water))
            if size > 0.0 and water_mol > 0.0 and _is_inflection(solver, point, size, water_mol):
                reagent_names = _reagent_names(matter, mixture, vessel, crossing, lower, upper)
                if reagent_names is not None:
                    yield _Equivalent(crossing, Equivalence.ACID_AND_BASE, *reagent_names)


def _is_inflection(solver: Solver, point: FloatArray, size: float, water: float) -> bool:
    """Whether the pH is steepest where as many protons are there as counted, and flatter on both sides."""
    totals = np.tile(point, (len(HALF_STEP_FRACTIONS), 1))
    totals[:, 0] += HALF_STEP_FRACTIONS * size
    count = len(totals)
    solids = np.array([phase.column.endswith(SOLID) for phase in solver.mixture.phases], dtype=np.bool_)
    ph = solver.equilibrium(totals, np.full(count, water), np.full(count, WITHOUT_HEAT_C), solids).ph
    steepness, middle_steps = (
        -np.diff(ph) / np.diff(HALF_STEP_FRACTIONS),
        0.5 * (HALF_STEP_FRACTIONS[1:] + HALF_STEP_FRACTIONS[:-1]),
    )
    is_near_cut = np.abs(middle_steps) <= INFLECTION_TOLERANCE
    flatter_sides = (
        steepness[middle_steps < -INFLECTION_TOLERANCE].min(),
        steepness[middle_steps > INFLECTION_TOLERANCE].min(),
    )
    return bool(steepness[is_near_cut].max() > STEEPNESS_RATIO * max(flatter_sides))


def _reagent_names(
    matter: Matter, mixture: Mixture, vessel: str, crossing: _Crossing, lower: float, upper: float
) -> tuple[str, str] | None:
    """Acids and bases, as they were brought, that are equivalent at a cut; ``None``: one of the two is missing."""
    history = matter.histories[vessel]
    source_indices = np.flatnonzero(history.added_ml[crossing.row_after] > history.added_ml[crossing.row_before])
    contents_of_vessel = matter.recipe.contents
    sources = [name for name, index in matter.ledger.at.items() if index in source_indices]
    titrants = {
        formula for name in sources if name in contents_of_vessel for formula in contents_of_vessel[name].amounts
    }
    brought_formulas = {
        column.removesuffix(ADDED_SUFFIX)
        for column in matter.ledger.column
        if column.endswith(ADDED_SUFFIX) and matter.amount(vessel, column)[crossing.row_before] > 0.0
    }

    def steps(formula: str) -> list[float]:
        return [
            pka
            for component in dissolved_components(formula)
            if component in mixture.components[1:]
            for pka in mixture.pka(component)
        ]

    def protons(formula: str) -> float:
        components = dissolved_components(formula)
        least_protons = sum(
            many * mixture.least_protons(component)
            for component, many in components.items()
            if component in mixture.components[1:]
        )
        return components.get(PROTON, 0) - least_protons

    def is_base(formula: str) -> bool:
        sites = sum(
            many * len(mixture.pka(component))
            for component, many in dissolved_components(formula).items()
            if component in mixture.components[1:]
        )
        return sites > protons(formula)

    def gives_protons(formula: str) -> bool:
        is_strong = all(pka <= STRONGEST for pka in steps(formula))
        return protons(formula) > 0 and (is_strong or any(pka <= lower for pka in steps(formula)))

    def takes_protons(formula: str) -> bool:
        return protons(formula) < 0 or (is_base(formula) and any(pka >= upper for pka in steps(formula)))

    own_formulas = sorted(brought_formulas - titrants) or sorted(brought_formulas)
    if crossing.rising:
        acids, bases = (
            sorted(formula for formula in titrants if protons(formula) > 0),
            [formula for formula in own_formulas if takes_protons(formula)],
        )
    else:
        acids, bases = (
            [formula for formula in own_formulas if gives_protons(formula)],
            sorted(formula for formula in titrants if protons(formula) < 0 or is_base(formula)),
        )
    return (" + ".join(acids), " + ".join(bases)) if acids and bases else None


def _redox_points(matter: Matter, vessel: str, find: CrossingFinder) -> Crossings:
    """Yields the crossings at which the second reagent of an equation begins to be left over."""
    for row, process in enumerate(matter.recipe.processes):
        reagents = _redox_reagents(process)
        has_undissolved = any(column.endswith((SOLID, GAS)) for column in reagents)
        if (
            process.rate is None
            and len(reagents) == 2
            and not has_undissolved
            and matter.histories[vessel].extents[-1, row] > 0.0
        ):
            first_mol, second_mol = (
                matter.amount(vessel, column) / (_moles_in_solids(matter, row, column) - process.changes[column])
                for column in reagents
            )
            oxidant, reductant = (matter.recipe.reagent(row, column) for column in reagents)
            extent = matter.histories[vessel].extents[:, row]
            for crossing in find(first_mol - second_mol):
                reacted_mol = float(crossing.interpolate(extent))
                remaining = max(0.0, float(crossing.interpolate(np.minimum(first_mol, second_mol))))
                fraction = reacted_mol / (reacted_mol + remaining)
                yield _Equivalent(crossing, Equivalence.OXIDANT_AND_REDUCTANT, oxidant, reductant, fraction)


def _redox_reagents(process: Process) -> list[str]:
    """Columns that a process uses up, but for acid and water."""
    return sorted(column for column, many in process.changes.items() if many < 0.0 and column not in (PROTON, WATER))


def _moles_in_solids(matter: Matter, row: int, column: str) -> float:
    """Mol of a column in the solids at equilibrium that a mol of a process makes: the iodide of copper(I) iodide."""
    reaction = next(reaction for reaction in matter.recipe.reactions if reaction.process == row)
    solids = {matter.ledger.columns[index] for index in matter.ledger.reactions.phases.tolist()}
    return float(
        sum(
            many * dissolved_components(formula).get(column, 0)
            for formula, many in reaction.equation.products.items()
            if reaction.phases.get(formula) == "s" and formula + SOLID in solids
        )
    )


def _metal_and_anion_points(matter: Matter, vessel: str, totals: FloatArray) -> Crossings:
    """Yields the crossings of an ion and those that equations bind it to, in a complex or a solid, all but a little.

    Of several partners, such as calcium and magnesium with EDTA, all that are bound by then count together.
    """
    if matter.solver is None:
        return
    components = matter.solver.mixture.components
    pairs: dict[tuple[str, ...], str] = {}
    for reaction in matter.recipe.reactions:
        for formula in reaction.equation.products if reaction.process < 0 else ():
            solutes = solute_components(formula)
            if len(solutes) == 2 and len(METALS & set(solutes)) == 1 and set(solutes) <= set(components):
                pairs.setdefault(tuple(sorted(solutes)), formula)
    for ion, partners in _ions_and_partners(pairs):
        ion_total = totals[:, components.index(ion)]
        moles_of_product, needed_mol = [], np.zeros(len(ion_total))
        for partner in partners:
            formula = pairs[(min(ion, partner), max(ion, partner))]
            solutes = solute_components(formula)
            moles = totals[:, components.index(partner)] / solutes[partner]
            moles_of_product.append((formula, moles))
            needed_mol = needed_mol + moles * solutes[ion]
        competing_ions = {name for pair in pairs if ion in pair for name in pair} - {ion, *partners}
        for crossing in _zero_crossings(ion_total - needed_mol):
            has_competitor = any(
                float(crossing.interpolate(totals[:, components.index(name)])) > 0.0 for name in competing_ions
            )
            product_mol = [float(crossing.interpolate(moles)) for _, moles in moles_of_product]
            amount_made = _amount_made(matter, vessel, totals, crossing)
            fractions = [
                amount_made.get(formula, 0.0) / moles
                for (formula, _), moles in zip(moles_of_product, product_mol, strict=True)
                if moles > 0.0
            ]
            if len(fractions) == len(moles_of_product) and min(fractions) >= (
                LEAST_REACTED_BESIDE_PARTNER if has_competitor else LEAST_REACTED_FRACTION
            ):
                reagent_names = (
                    sorted((ion, " + ".join(partners))) if len(partners) == 1 else [ion, " + ".join(partners)]
                )
                yield _Equivalent(
                    crossing, Equivalence.METAL_AND_ANION, reagent_names[0], reagent_names[1], min(fractions)
                )


def _ions_and_partners(pairs: Iterable[tuple[str, ...]]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Ions and partners that they may be equivalent to: one, or several of them together."""
    partners: dict[str, set[str]] = {}
    for ion, other_ion in pairs:
        yield ion, (other_ion,)
        partners.setdefault(ion, set()).add(other_ion)
        partners.setdefault(other_ion, set()).add(ion)
    for ion, mine in sorted(partners.items()):
        for count in range(2, min(len(mine), MOST_PARTNERS) + 1):
            for several_partners in combinations(sorted(mine), count):
                yield ion, several_partners


def _amount_made(matter: Matter, vessel: str, totals: FloatArray, crossing: _Crossing) -> dict[str, float]:
    """Formula of each complex and solid -> mol of it at the very crossing, where PHREEQC has an answer."""
    solver, history, ledger = matter.solver, matter.histories[vessel], matter.ledger
    assert solver is not None
    water = crossing.interpolate(history.amounts[:, ledger.water])
    celsius = crossing.interpolate(matter.celsius(vessel, history.times))
    equilibria = solver.equilibrium(
        crossing.interpolate(totals)[None], np.atleast_1d(water), np.atleast_1d(celsius), ~ledger.reactions.gas
    )
    if np.isnan(equilibria.ph[0]):
        return {}
    amount_made = {}
    for reaction in matter.recipe.reactions:
        for formula in reaction.equation.products:
            column = formula + SOLID
            names = [phase.column for phase in solver.mixture.phases]
            row = solver.mixture.row_of(formula)
            if column in names:
                amount_made[formula] = float(equilibria.phases[0, names.index(column)])
            elif row is not None:
                amount_made[formula] = float(equilibria.species[0, row])
    return amount_made


def _zero_crossings(excess: FloatArray) -> Iterator[_Crossing]:
    rows = np.flatnonzero(np.abs(excess) > LEAST_EXCESS_FRACTION * np.abs(excess).max(initial=0.0))
    signs = np.sign(excess[rows])
    for change_row in np.flatnonzero(np.diff(signs)).tolist():
        a, b = int(rows[change_row]), int(rows[change_row + 1])
        yield _Crossing(a, b, float(excess[a] / (excess[a] - excess[b])), bool(excess[b] > excess[a]))
