"""The ledger of a run: all that moved, in order of time, and what reacted. Effects of chemistry are views of it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray, IntArray
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.contents import Contents, contents_of
from replay.effects.chemistry.enthalpy import CONSTANTS
from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.ledger import Ledger
from replay.effects.chemistry.ledger_columns import (
    ADDED_SUFFIX,
    HEAT_COLUMN,
    UNFOLLOWED_WARMTH,
    WITHOUT_HEAT_C,
    Flame,
    Warmth,
)
from replay.effects.chemistry.processes import History
from replay.effects.chemistry.recipe import Recipe, recipe_of
from replay.effects.chemistry.salts import WATER_KG, Salt, saturation_fraction
from replay.effects.chemistry.solver import Equilibrium, Solver
from replay.effects.chemistry.warming import solid_j_per_mol_k
from replay.effects.declaring import Declaration
from replay.effects.flame import flame_power, flames_under_liquids, heat_of_ledger, spans_over_flame
from replay.effects.inputs import EffectInputs
from replay.effects.models.outflow import LONGEST_PAUSE_S, Stream
from replay.effects.movement import movement_of
from replay.effects.temperatures import liquid_boils
from replay.effects.vessels import Vessel, vessels_of

MOST_FOREIGN_MOL_KG: Final = 0.5
"""Of other ions beside a salt near saturation: beyond it the table is more than 5 % off PHREEQC's pitzer.dat.

By 55 % of NaCl in 3 mol/kg of HCl (tests/replay/effects/chemistry/test_brines.py).
"""

UNDISSOCIATED_WATER: Final = 50.0
"""mol of water for one of sulfuric acid, up to which PHREEQC has it as HSO4- alone."""

SALTING_OUT_KG_MOL: Final = 0.08
"""Powers of ten by which a mol/kg of other ions lowers a salt's mean mol/kg at saturation, at most.

By PHREEQC's pitzer.dat, of five salts beside nine electrolytes (tests/replay/effects/chemistry/test_brines.py).
"""


@dataclass(frozen=True, eq=False)
class Matter:
    """Everything in every vessel."""

    recipe: Recipe
    ledger: Ledger
    vessels: Mapping[str, Vessel]
    histories: Mapping[str, History]

    @property
    def solver(self) -> Solver | None:
        """PHREEQC; ``None``: nobody asks it."""
        return self.ledger.solver

    @property
    def is_still(self) -> bool:
        """Whether no liquid moved from one vessel to another, or out of one."""
        return not any(
            history.added_ml[-1].any() or np.ptp(history.volume_ml) > 0.0 for history in self.histories.values()
        )

    def amount(self, vessel: str, column: str) -> FloatArray:
        """Mol (n,) of a column at the rows of a vessel's history; zeros for what never was in it."""
        history = self.histories[vessel]
        index = self.ledger.column.get(column)
        return np.zeros(len(history.times)) if index is None else history.amounts[:, index]

    def states(self, vessel: str, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Amounts (n, columns), extents (n, processes) and millilitres (n,) of a vessel at times.

        Between two rows a slow process nears its end by exp(-rate t), and those at once follow it.
        """
        history, ledger = self.histories[vessel], self.ledger
        rows = history.rows(times)
        amounts, extents = history.amounts[rows], history.extents[rows]
        elapsed_seconds = np.maximum(0.0, times - history.times[rows])
        goes_on = np.zeros(len(times), dtype=np.bool_)
        for row in ledger.slow:
            further_extent = history.pending[rows, row] * -np.expm1(
                -elapsed_seconds * (ledger.processes[row].rate or 0.0)
            )
            extents[:, row] += further_extent
            amounts += further_extent[:, None] * ledger.changes[row]
            goes_on |= further_extent > 0.0
        if goes_on.any() and ledger.reactions.quick_processes:
            # What a slow reaction makes may react at once, as the iodine of an iodine clock does.
            followed = amounts[goes_on]
            extents[goes_on] += ledger.reactions.run_processes(followed)
            amounts[goes_on] = followed
        return amounts, extents, history.volume_ml[rows]

    def kelvin(self, vessel: str, times: FloatArray) -> FloatArray:
        """Above the room (n,) at times; between two rows by Newton's law, and the power of a flame."""
        history, ledger = self.histories[vessel], self.ledger
        rows = history.rows(times)
        capacity = ledger.capacity(ledger.at[vessel], history.volume_ml[rows], history.amounts[rows])
        nonzero_capacity = np.where(capacity > 0.0, capacity, 1.0)
        elapsed_seconds = np.maximum(0.0, times - history.times[rows])
        excess = self.amount(vessel, HEAT_COLUMN)[rows] / nonzero_capacity
        flame = ledger.warmth.flames.get(vessel)
        power_w = 0.0 if flame is None else flame.power(history.times[rows])
        return ledger.excess_after_seconds(ledger.at[vessel], excess, elapsed_seconds, power_w, nonzero_capacity)

    def is_mixed(self, vessel: str, times: FloatArray, volume_ml: FloatArray) -> BoolArray:
        """Whether what is in a vessel is mixed, (n,): its temperature and its strength are then those of all of it.

        Of a vessel that holds a dry solid at first it is not while liquid comes in: the first drops cannot dissolve
        all. The first row counts, and the last.
        """
        contents = self.recipe.contents.get(vessel)
        if contents is None or contents.volume_ml > 0.0 or not contents.solids:
            return np.ones(len(times), dtype=np.bool_)
        is_mixed_at = _is_settled(times, volume_ml)
        is_mixed_at[-1:] = True
        is_mixed_at[:1] |= times[:1] <= self.histories[vessel].times[0]
        return is_mixed_at

    def celsius(self, vessel: str, times: FloatArray) -> FloatArray:
        """Temperature (n,) at times, that of PHREEQC's constants where no effect heat follows one."""
        if not self.ledger.warmth.followed:
            return np.full(len(times), WITHOUT_HEAT_C)
        return self.ledger.warmth.room + self.kelvin(vessel, times)

    def equilibria(self, vessel: str, times: FloatArray) -> tuple[IntArray, Equilibrium]:
        """Rows (k,) of the times at which there is a liquid, and its equilibrium there.

        A bubble that left stays away, and no more may bubble.
        """
        ledger = self.ledger
        assert ledger.solver is not None
        amounts, _, volume_ml = self.states(vessel, times)
        wet_rows = np.flatnonzero((volume_ml > 0.0) & (amounts[:, ledger.water] > 0.0))
        celsius = self.celsius(vessel, times[wet_rows])
        totals, water = self.totals(amounts[wet_rows]), amounts[wet_rows, ledger.water]
        return wet_rows, ledger.solver.equilibrium(totals, water, celsius, ~ledger.reactions.gas)

    def brine(self, vessel: str, salt: Salt) -> BoolArray:
        """Rows (n,) of a history at which a salt is near saturation beside more of other ions than its table allows.

        While liquid comes in none count: what reacts with it may dissolve all of the salt.
        """
        ledger, history = self.ledger, self.histories[vessel]
        amounts = history.amounts
        kilograms = np.maximum(amounts[:, ledger.water] * WATER_KG, 1e-300)
        ions = {component: many for component, many in salt.components.items() if component not in (PROTON, WATER)}
        dissolved = np.min([amounts[:, ledger.column[component]] / many for component, many in ions.items()], axis=0)
        charges = amounts @ ledger.ion_charges + np.abs(amounts[:, ledger.proton])
        own_charge = sum(many * abs(charge_of(component)) for component, many in ions.items()) + abs(
            salt.components.get(PROTON, 0)
        )
        foreign_strength = 0.5 * (charges - own_charge * dissolved) / kilograms
        fraction = saturation_fraction(salt, ledger.column, amounts, self.celsius(vessel, history.times))
        is_near_saturation = fraction > 10.0 ** (-SALTING_OUT_KG_MOL * foreign_strength)
        is_near_saturation |= amounts[:, ledger.column[salt.column]] > 0.0
        is_settled = _is_settled(history.times, history.volume_ml)
        return is_near_saturation & is_settled & (foreign_strength > MOST_FOREIGN_MOL_KG)

    def brines(self, vessel: str) -> dict[str, float]:
        """Salt column -> time at which its solution becomes a brine, of those that do."""
        times = self.histories[vessel].times
        brine_rows = {salt.column: np.flatnonzero(self.brine(vessel, salt)) for salt in self.recipe.salts}
        return {column: float(times[rows[0]]) for column, rows in brine_rows.items() if len(rows)}

    def totals(self, amounts: FloatArray) -> FloatArray:
        """Mol (n, components) of each component of the equilibrium, dissolved and in solids together."""
        ledger = self.ledger
        solids = amounts[:, ledger.reactions.phases] * ~ledger.reactions.gas
        return (amounts - solids @ ledger.reactions.formation)[:, ledger.reactions.components]


def matter_of(inputs: EffectInputs) -> Matter:
    """The ledger of this run, made once."""
    return inputs.shared_object("matter", lambda: new_matter(inputs))


def new_matter(inputs: EffectInputs) -> Matter:
    """A new ledger of what the vessels of a run hold, after all its frames."""
    liquid_movement = movement_of(inputs)
    mixed_vessels = (name for declared in inputs.tables.get("mixing", ()) for name in declared["in"])
    vessels = {**vessels_of(inputs, mixed_vessels), **liquid_movement.vessels}
    recipe = recipe_of(inputs.tables, {name: contents_of(vessel) for name, vessel in vessels.items()})
    fraction = max((table["solid_fraction"] for table in inputs.tables.get("pour", ())), default=0.0)
    ledger = recipe.ledger(fraction, _declared_warmth(inputs, vessels, recipe))
    times = inputs.times
    ledger.begin(float(times[0]))
    for frames, streams, volume_ml in _segments(liquid_movement.streams, times):
        pairs, over = (
            [(stream.source, stream.target) for stream in streams],
            np.array([stream.over for stream in streams]),
        )
        ledger.flow(frames, times[frames], pairs, volume_ml, over)
    ledger.end(len(times) - 1, float(times[-1]))
    return Matter(recipe, ledger, vessels, {name: ledger.history(name) for name in vessels})


def _is_settled(times: FloatArray, volume_ml: FloatArray) -> BoolArray:
    """Rows (n,) of a vessel's times after which no liquid comes in before a pause."""
    inflow_times = times[1:][np.diff(volume_ml) > 0.0]
    next_inflow = np.append(inflow_times, np.inf)[np.searchsorted(inflow_times, times, side="right")]
    return np.asarray(next_inflow - times > LONGEST_PAUSE_S)


def _declared_warmth(inputs: EffectInputs, vessels: Mapping[str, Vessel], recipe: Recipe) -> Warmth:
    """How the liquids' heat is followed."""
    declared = heat_of_ledger(inputs.tables)
    if declared is None:
        return UNFOLLOWED_WARMTH
    room, per_ml = declared["ambient_c"], declared["heat_capacity_j_per_ml_k"]
    brought = {formula for contents in recipe.contents.values() for formula in contents.amounts}
    acid = next((formula for formula in CONSTANTS["dilution"] if formula in brought), "")
    flames = {table["heats"]: _flame(inputs, table) for table in flames_under_liquids(inputs.tables)}
    heated = {name for name, vessel in vessels.items() if name in flames or vessel.celsius(room) != room}
    return Warmth(
        per_ml=per_ml,
        glass={name: vessel.glass_j_per_k for name, vessel in vessels.items()},
        solids={
            name: _solids_capacity(vessel, recipe.contents.get(name), is_heated=name in heated)
            for name, vessel in vessels.items()
        },
        solutes={name: _solutes(contents) for name, contents in recipe.contents.items()} if per_ml is None else {},
        excess={name: vessel.celsius(room) - room for name, vessel in vessels.items()},
        loss=declared["loss_w_per_k"],
        most=liquid_boils(declared) - room,
        room=room,
        solute=acid and acid + ADDED_SUFFIX,
        dilution=dilution_of(acid, has_phreeqc=recipe.solver is not None),
        flames=flames,
        declared=tuple(sorted(recipe.declared_heats & {salt.formula for salt in recipe.salts})),
    )


def _flame(inputs: EffectInputs, declared: Declaration) -> Flame:
    times = inputs.times
    power_w = flame_power(declared, spans_over_flame(inputs, declared), len(times))
    rows = [0, *(np.flatnonzero(np.diff(power_w)) + 1).tolist()]
    return Flame(times[rows], power_w[rows], declared["loss_w_per_k"])


def _solids_capacity(vessel: Vessel, contents: Contents | None, *, is_heated: bool) -> float:
    """J/K of the solids in a vessel; 0 where what is declared of a dry vessel that is heated is theirs."""
    if contents is None:
        return 0.0
    if is_heated and contents.volume_ml <= 0.0 and vessel.glass_j_per_k > 0.0:
        return 0.0
    return sum(amount * solid_j_per_mol_k(formula) for formula, amount in contents.solids.items())


def _solutes(contents: Contents) -> float:
    """J/K of what is dissolved in a vessel."""
    return sum(amount * solid_j_per_mol_k(formula) for formula, amount in contents.amounts.items() if formula != WATER)


def dilution_of(acid: str, *, has_phreeqc: bool) -> Mapping[float, float]:
    """Mol of water for one of acid -> J/mol; ``has_phreeqc``: PHREEQC has the heat of its anions in much water."""
    heats = {float(water): 1e3 * kilojoule for water, kilojoule in CONSTANTS["dilution"].get(acid, {}).items()}
    return {water: joule for water, joule in heats.items() if water <= UNDISSOCIATED_WATER or not has_phreeqc}


def _segments(streams: tuple[Stream, ...], times: FloatArray) -> Iterator[tuple[IntArray, list[Stream], FloatArray]]:
    """Frames, streams and millilitres (frames, streams) of stretches in which the same streams flow."""
    frames = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(stream.frames for stream in streams)]))
    volumes = np.zeros((len(frames), len(streams)))
    for column, stream in enumerate(streams):
        volumes[np.searchsorted(frames, stream.frames), column] = stream.volume_ml
    is_flowing = volumes > 0.0
    is_break = (is_flowing[1:] != is_flowing[:-1]).any(axis=1) | (np.diff(times[frames]) > LONGEST_PAUSE_S)
    segment_bounds = [0, *(np.flatnonzero(is_break) + 1).tolist(), len(frames)]
    for first, stop in pairwise(segment_bounds):
        if stop > first:
            active_streams, rows = np.flatnonzero(is_flowing[first]), frames[first:stop]
            yield rows, [streams[column] for column in active_streams.tolist()], volumes[first:stop][:, active_streams]
