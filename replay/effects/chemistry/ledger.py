"""One ledger of matter and heat: all that is in every vessel, moved and changed, never made or lost.

A column is a part of what is dissolved (``Ag+``; of ``H+`` less than nothing is hydroxide), a solid (``AgCl(s)``), a
gas that left (``H2(g)``), what was added under a formula, followed for the reader and never changed (``HCl added``), or
energy in J. Row -1 of the state is everything outside the vessels.

What came together reacts: equations without a constant to their end or at their rate, salts up to their solubility,
the rest to PHREEQC's equilibrium. The ledger keeps the totals; PHREEQC says what stands as what.
"""

from collections.abc import Mapping, Sequence
from itertools import chain, pairwise
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray, IntArray
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.heats import Heats
from replay.effects.chemistry.ledger_columns import (
    ADDED_SUFFIX,
    ENERGY_COLUMNS,
    HEAT_CAPACITY_COLUMN,
    HEAT_COLUMN,
    LATENT_HEAT_COLUMN,
    UNFOLLOWED_WARMTH,
    WITHOUT_HEAT_C,
    Warmth,
    changes_table,
)
from replay.effects.chemistry.limits import Limits
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.processes import History, Process
from replay.effects.chemistry.quick_reactions import QuickReactions
from replay.effects.chemistry.salts import WATER_KG, Salt
from replay.effects.chemistry.solver import Solver
from replay.effects.chemistry.warming import temperature_after_seconds

SPENT_FRACTION: Final = 1e-12
"""A rest below this share of what a vessel held goes with the last drop: it is rounding."""
FIRST_STEP_FRACTION: Final = 0.02
"""Where a slow reaction meets others it goes in steps of this share of its time at first: 1 % of what reacts in one."""
STEP_GROWTH: Final = 1.05
"""Of these steps, one to the next: what is left to react falls by itself."""
REACTION_TIMES: Final = 50.0
"""What is left after so many times the reaction's own time is nothing to speak of."""
FLOW_STEPS: Final = 64
"""Steps into which a flow is cut at least where it runs over, or what receives it reacts slowly or grows warm."""
FLOW_STEP_ML: Final = 0.1
"""Most of such a step, two drops: a titration that is followed by a thermometer shows its end point as well."""


CRYOSCOPIC_K_KG_MOL: Final = 1.86
"""Kelvin by which a mol of ions or molecules lowers the freezing point of a kg of water. Source: CRC Handbook."""

LOWEST_FREEZING_C: Final = -21.1
"""Eutectic of salt and water, the coldest that common solutions get before all of it is solid. Source: CRC Handbook."""

MOST_TEMPERATURE_TRIALS: Final = 8
TEMPERATURE_TOLERANCE_K: Final = 0.2
"""Trials, and how near two must be, of the temperature at which what dissolves gives just the heat that leads to it."""

KELVIN_STEP: Final = 0.25
"""A solution beside a solid is looked at again when it has cooled or warmed by so much."""

MOST_STEPS: Final = 800
"""Of these in one go."""


class Ledger:
    """Vessels, columns and processes, and the state they are in.

    Parameters
    ----------
    vessels, columns : names; columns of processes and of the equilibrium are there anyway.
    processes : equations without a constant.
    solver : what is at equilibrium by PHREEQC; ``None``: nothing is.
    salts : solids that dissolve up to their solubility.
    solid_fraction : of a solid that is poured along with the liquid.
    warmth : how heat is followed.
    slow_solids : PHREEQC with the solids that a process dissolves at its rate; ``None``: there are none.
    """

    def __init__(
        self,
        vessels: Sequence[str],
        columns: Sequence[str],
        processes: Sequence[Process],
        solver: Solver | None,
        salts: Sequence[Salt] = (),
        solid_fraction: float = 0.0,
        warmth: Warmth = UNFOLLOWED_WARMTH,
        slow_solids: Solver | None = None,
    ) -> None:
        self.vessels, self.processes, self.solver, self.warmth = vessels, processes, solver, warmth
        self.salts = salts
        produced_changes = [process.changes for process in processes] + [salt.changes for salt in salts]
        catalysts = chain.from_iterable(sorted(process.catalysts) for process in processes)
        phase_changes = () if solver is None else solver.mixture.changes
        components: tuple[str, ...] = () if solver is None else solver.mixture.components
        permanent_columns = (PROTON, WATER, *ENERGY_COLUMNS)
        self.columns = tuple(
            dict.fromkeys(chain(columns, *produced_changes, *phase_changes, catalysts, components, permanent_columns))
        )
        self.at = {name: index for index, name in enumerate((*vessels, ""))}
        self.column = {name: index for index, name in enumerate(self.columns)}
        vessel_count = len(self.at)
        self._cuts = np.cumsum([1, len(self.columns), len(processes)])
        self.state = np.zeros(
            (vessel_count, int(self._cuts[-1]) + vessel_count)
        )  # as `_state_columns` names its columns
        volume, self.amounts, self.extents, _ = self._state_columns(self.state)
        self.volume_ml = volume[:, 0]
        self.clock = np.zeros(vessel_count)
        self.solid_fraction = solid_fraction
        fractions = {GAS: 0.0, SOLID: solid_fraction}
        self.moving = np.array([fractions.get(column[-3:], 1.0) for column in self.columns])
        self.glass = np.array([warmth.glass.get(name, 0.0) for name in self.at])
        self.flames = {self.at[name]: flame for name, flame in warmth.flames.items()}
        self.loss = np.full(vessel_count, warmth.loss)
        for index, flame in self.flames.items():
            self.loss[index] = flame.loss
        self.power_w = np.zeros(vessel_count)  # of flames, now
        self.slow = [row for row, process in enumerate(processes) if process.rate is not None]
        self.proton, self.water = self.column[PROTON], self.column[WATER]
        is_counted = [name not in (PROTON, WATER, *ENERGY_COLUMNS) for name in self.columns]
        is_counted = [
            here and not name.endswith((SOLID, GAS, ADDED_SUFFIX))
            for here, name in zip(is_counted, self.columns, strict=True)
        ]
        self._is_dissolved_column = np.array(is_counted)
        self.ion_charges = np.array(
            [float(abs(charge_of(name))) if here else 0.0 for here, name in zip(is_counted, self.columns, strict=True)]
        )
        room_c = warmth.room if warmth.followed else WITHOUT_HEAT_C
        self.changes = changes_table([process.changes for process in processes], self.column)
        self.limits = Limits(processes, self.changes, self.column, solver, slow_solids, room_c)
        self.heats = Heats(self.column, None if solver is None else solver.mixture, salts, warmth)
        self.reactions = QuickReactions(
            processes,
            salts,
            solver,
            self.column,
            self.limits,
            self.heats,
            follows_heat=warmth.followed,
        )
        # A slow process that nothing else touches is in closed form from one event to the next.
        self._has_closed_form = len(processes) == 1 and not self.reactions.has_phases_or_salts and not warmth.followed
        self._blocks: list[list[tuple[FloatArray, IntArray, FloatArray]]] = [[] for _ in range(vessel_count)]

    def fill(self, vessel: str, volume_ml: float, amounts: Mapping[str, float]) -> None:
        """Put something into a vessel at the begin."""
        index = self.at[vessel]
        self.volume_ml[index] += volume_ml
        for name, amount in amounts.items():
            self.amounts[index, self.column[name]] += amount

    def begin(self, time: float) -> None:
        """React what stands together at the first frame, and note it; what heat that gave is gone."""
        self.clock[:] = time
        for index, name in enumerate(self.vessels):
            excess = self.warmth.excess.get(name, 0.0)
            # At its own temperature it is brought to equilibrium; what heat that gave is gone before the recording.
            solids_capacity, solutes_capacity = (
                known_capacities.get(name, 0.0) for known_capacities in (self.warmth.solids, self.warmth.solutes)
            )
            self.amounts[index, self.column[HEAT_CAPACITY_COLUMN]] = solids_capacity + solutes_capacity
            heat = excess * float(self.capacity(index, self.volume_ml[index], self.amounts[index]))
            self.amounts[index, self.column[HEAT_COLUMN]] = heat
            self._react_state(index, self.state[index : index + 1], trials=0)
            # What dissolved or reacted has another heat capacity, at the temperature that the vessel has.
            settled_heat = excess * float(self.capacity(index, self.volume_ml[index], self.amounts[index]))
            self.amounts[index, self.column[HEAT_COLUMN]] = settled_heat
            self.amounts[index, self.column[LATENT_HEAT_COLUMN]] = 0.0
            self._note_state(index, 0, time)

    def capacity(self, index: int, volume_ml: FloatArray | float, amounts: FloatArray) -> FloatArray:
        """Heat capacity, J/K, of a vessel with so much in it, solids (..., columns) included."""
        solid, dissolved = self.heats.capacities(amounts)
        return self.heats.liquid(volume_ml, amounts) + self.glass[index] + solid + dissolved

    def advance(self, index: int, frame: int, time: float) -> None:
        """Let slow processes, a flame and the loss of heat of a vessel go on to a time."""
        flame = self.flames.get(index)
        if flame is not None:
            changes = flame.times[(flame.times > self.clock[index]) & (flame.times < time)]
            for change in changes.tolist():
                self._advance_at_steady_power(index, frame, change)
                self._note_state(index, frame, change)
        self._advance_at_steady_power(index, frame, time)

    def _advance_at_steady_power(self, index: int, frame: int, time: float) -> None:
        if index in self.flames:
            self.power_w[index] = self.flames[index].power(self.clock[index])
        since = time - self.clock[index]
        begin, self.clock[index] = self.clock[index], max(time, self.clock[index])
        if since <= 0.0:
            return
        waiting = self.pending_extents(self.amounts[index], self._celsius_now(index)) > 0.0
        rates = [self.processes[row].rate or 0.0 for row in self.slow if waiting[row]]
        seconds_done, step = 0.0, since if self._has_closed_form or not rates else FIRST_STEP_FRACTION / max(rates)
        while rates and seconds_done < min(since, REACTION_TIMES / max(rates)):
            component = min(step, since - seconds_done)
            self._exchange_heat(index, component)
            self._run_slow_processes(index, component)
            self._react_state(index, self.state[index : index + 1])
            seconds_done += component
            step *= STEP_GROWTH
            if not self._has_closed_form:
                self._note_state(index, frame, float(begin + seconds_done))
        self._exchange_heat_with_room(index, frame, float(begin + seconds_done), since - seconds_done)

    def celsius(self, index: int, rows: FloatArray) -> FloatArray:
        """Temperature (n,) of rows of the state of a place."""
        volume, amounts, *_ = self._state_columns(rows)
        if not self.warmth.followed:
            return np.full(len(rows), WITHOUT_HEAT_C)
        capacity = np.asarray(self.capacity(index, volume[:, 0], amounts))
        return self.warmth.room + amounts[:, self.column[HEAT_COLUMN]] / np.where(capacity > 0.0, capacity, 1.0)

    def _celsius_now(self, index: int) -> FloatArray:
        """Temperature (1,) of a place."""
        return self.celsius(index, self.state[index : index + 1])

    def excess_after_seconds(
        self,
        index: int,
        excess: FloatArray | float,
        seconds: FloatArray | float,
        power_w: FloatArray | float,
        capacity: FloatArray | float,
    ) -> FloatArray:
        """Kelvin above the room (...) of a vessel after some seconds; steam takes along what a flame gives beyond."""
        reached = temperature_after_seconds(
            excess, seconds, power_w=power_w, capacity=capacity, loss=float(self.loss[index])
        )
        return np.where(np.asarray(power_w) > 0.0, np.minimum(reached, np.maximum(excess, self.warmth.most)), reached)

    def freezing_point_c(self, amounts: FloatArray) -> FloatArray:
        """Freezing point (n,) in degC of what is dissolved in rows (n, columns)."""
        kilograms = amounts[:, self.water] * WATER_KG
        molal = (amounts[:, self._is_dissolved_column].sum(axis=1) + np.abs(amounts[:, self.proton])) / np.where(
            kilograms > 0.0, kilograms, np.inf
        )
        return np.maximum(LOWEST_FREEZING_C, -CRYOSCOPIC_K_KG_MOL * molal)

    def _exchange_heat_with_room(self, index: int, frame: int, time: float, seconds: float) -> None:
        """Let a vessel cool or warm towards the room or by a flame; what reacts or settles follows on the way."""
        state_row = self.state[index : index + 1]
        if (
            not (self.warmth.followed and self.reactions.has_phases_or_salts)
            or seconds <= 0.0
            or self.volume_ml[index] <= 0.0
        ):
            self._exchange_heat(index, seconds)
            return
        capacity = float(self.capacity(index, self.volume_ml[index], self.amounts[index]))
        excess = float(self.amounts[index, self.column[HEAT_COLUMN]]) / capacity
        temperature_change = abs(
            excess - float(self.excess_after_seconds(index, excess, seconds, self.power_w[index], capacity))
        )
        step_count = min(MOST_STEPS, int(np.ceil(temperature_change / KELVIN_STEP)))
        for step in range(step_count):
            self._exchange_heat(index, seconds / step_count)
            self._run_slow_processes(index, seconds / step_count)
            self._react_state(index, state_row)
            if step < step_count - 1:
                self._note_state(index, frame, time + seconds * (step + 1) / step_count)

    def flow(
        self,
        frames: IntArray,
        times: FloatArray,
        pairs: Sequence[tuple[str, str]],
        volume_ml: FloatArray,
        over: BoolArray,
    ) -> None:
        """Flows (source, target) over frames (m,) with millilitres (m, pairs): each frame is a step, all at once.

        ``over`` (pairs,): it runs over a brim, after the others. A chain, in which what gives also gets, goes frame by
        frame; where something runs over, reacts slowly or grows warm it goes in steps of `FLOW_STEP_ML`.
        """
        flow_ends = [(self.at[source], self.at[target]) for source, target in pairs]
        receiving_indices = {target for _, target in flow_ends}
        has_chain = any(
            source in receiving_indices for (source, _), brim in zip(flow_ends, over, strict=True) if not brim
        )
        has_slow_process = any(
            self._reacts_slowly(index, flow_ends)
            for index in receiving_indices.union(source for source, _ in flow_ends)
        )
        if not (has_chain or over.any() or has_slow_process or self.warmth.followed):
            self._flow_at_once(frames, times, flow_ends, volume_ml)
            return
        lumps = max(FLOW_STEPS, int(np.ceil(volume_ml.sum() / FLOW_STEP_ML)))
        step_count = len(frames) if has_chain else min(len(frames), lumps)
        for first, stop in pairwise(np.linspace(0, len(frames), step_count + 1).astype(np.int64).tolist()):
            component, last = volume_ml[first:stop].sum(axis=0), slice(stop - 1, stop)
            for brim in (False, True):
                moving_columns = np.flatnonzero((over == brim) & (component > 0.0))
                if len(moving_columns):
                    self._flow_at_once(
                        frames[last],
                        times[last],
                        [flow_ends[k] for k in moving_columns.tolist()],
                        component[None, moving_columns],
                    )

    def _flow_at_once(
        self, frames: IntArray, times: FloatArray, flow_ends: Sequence[tuple[int, int]], volume_ml: FloatArray
    ) -> None:
        """Flows between places; in more than one frame no source may be a target."""
        # Row 0 of everything below is the state before.
        total_volumes = np.concatenate([np.zeros((1, len(flow_ends))), np.cumsum(volume_ml, axis=0)])
        indices = sorted({index for source_and_target in flow_ends for index in source_and_target})
        for index in indices:
            self.advance(index, int(frames[-1]), float(times[-1]))
        states = {index: np.repeat(self.state[index : index + 1], len(total_volumes), axis=0) for index in indices}
        for (source, target), gone_ml in zip(flow_ends, total_volumes.T, strict=True):
            self._move_liquid(source, states[source], states[target], gone_ml)
        receiving_indices = {target for _, target in flow_ends}
        for index, rows in states.items():
            if index != self.at[""]:
                # What only gives keeps its composition, and stays at equilibrium with its solids.
                if index in receiving_indices:
                    self._react_state(index, rows[1:])
                self._blocks[index].append((times, frames, rows[1:]))
            self.state[index] = rows[-1]

    def history(self, vessel: str) -> History:
        """All that became of a vessel; of several rows of one time the last."""
        times, frames, rows = (np.concatenate(column) for column in zip(*self._blocks[self.at[vessel]], strict=True))
        is_last_of_time = np.append(np.diff(times) > 0.0, True)
        volume, amounts, extents, added = self._state_columns(rows[is_last_of_time])
        remaining_extents = self.pending_extents(amounts, self.celsius(self.at[vessel], rows[is_last_of_time]))
        return History(
            times[is_last_of_time],
            frames[is_last_of_time].astype(np.int64),
            volume[:, 0],
            amounts,
            extents,
            remaining_extents,
            added,
        )

    def end(self, frame: int, time: float) -> None:
        """Note every vessel at the last frame."""
        for index in range(len(self.vessels)):
            self.advance(index, frame, time)
            self._note_state(index, frame, time)

    def _state_columns(self, rows: FloatArray) -> list[FloatArray]:
        """Splits rows of the state: millilitres (n, 1), amounts, extents, and millilitres from each vessel."""
        return np.split(rows, self._cuts, axis=1)

    def _move_liquid(self, source: int, source_rows: FloatArray, target_rows: FloatArray, gone_ml: FloatArray) -> None:
        """Take from one place what is gone (m + 1,) mL, with its share of everything, and give it to another."""
        (volume, amounts, *_), volume_before = self._state_columns(source_rows), self.volume_ml[source]
        fraction = np.minimum(1.0, gone_ml / volume_before) if volume_before > 0.0 else np.zeros(len(gone_ml))
        moving = self.moving
        if self.warmth.followed:
            moving = self._moving_heat(source, volume_before)
        component = fraction[:, None] * (moving * self.amounts[source])
        # Amounts fall to exactly nothing with the last drop: no share of a rounded rest stays behind.
        is_emptied = (gone_ml > 0.0) & (volume[:, 0] - gone_ml <= SPENT_FRACTION * volume_before)
        component = np.where(is_emptied[:, None] & (moving == 1.0), amounts, component)
        moved_volume = np.where(is_emptied, volume[:, 0], gone_ml)
        for rows, transfer_sign in ((source_rows, -1.0), (target_rows, 1.0)):
            volume, amounts, _, added = self._state_columns(rows)
            volume[:, 0] += transfer_sign * moved_volume
            amounts += transfer_sign * component
        added[:, source] += moved_volume

    def pending_extents(self, amounts: FloatArray, celsius: FloatArray | None = None) -> FloatArray:
        """Mol (..., processes) that slow processes would go on for at temperatures (n,); 0 for the others."""
        extents = np.zeros((*amounts.shape[:-1], len(self.processes)))
        for row in self.slow:
            extents[..., row] = np.maximum(0.0, self.limits.extent(row, amounts, celsius))
        return extents

    def _run_slow_processes(self, index: int, seconds: float) -> None:
        """Let slow processes of a vessel go on."""
        amounts = self.amounts[index]
        # 1 - exp(-rate dt) by expm1: for short steps the difference would lose its digits.
        fractions = [-np.expm1(-(process.rate or 0.0) * seconds) for process in self.processes]
        extents = self.pending_extents(amounts, self._celsius_now(index)) * fractions
        # All from the state before; together they take no more than there is.
        consumed = np.minimum(self.changes, 0.0) * extents[:, None]
        consumed[:, [self.proton, self.water]] = 0.0
        needed_amounts = -consumed.sum(axis=0)
        shortage_factor = float(
            np.max(needed_amounts / np.where(needed_amounts > 0.0, np.maximum(amounts, 1e-300), 1.0), initial=0.0)
        )
        extents /= max(1.0, shortage_factor)
        self.reactions.add_changes(amounts, extents @ self.changes)
        amounts[self.column[HEAT_COLUMN]] -= float(
            sum(extents[row] * self.reactions.process_joule(row) for row in self.slow)
        )
        self.extents[index] += extents

    def _react_state(self, index: int, rows: FloatArray, *, trials: int = MOST_TEMPERATURE_TRIALS) -> None:
        """Let rows of the state of a place, which follow each other in time, react at once, in place.

        A vessel without a liquid does not react. ``trials``: of the temperature to which its own heat leads; without
        them it reacts at the temperature that it has.
        """
        volume, every_amount, extents, _ = self._state_columns(rows)
        wet_rows = np.flatnonzero((volume[:, 0] > 0.0) & (every_amount[:, self.water] > 0.0))
        if len(wet_rows) and (
            self.reactions.quick_processes or self.reactions.has_phases_or_salts or self.warmth.followed
        ):
            celsius = self.celsius(index, rows[wet_rows])
            amounts, extents_done = self.reactions.react(every_amount[wet_rows], celsius)
            # What dissolves cools or warms what it dissolves in, and that changes how much dissolves.
            for _ in range(trials if self.warmth.followed and len(self.salts) else 0):
                capacity = np.asarray(self.capacity(index, volume[wet_rows, 0], amounts))
                reached_celsius = self._clip_celsius(
                    self.warmth.room + amounts[:, self.column[HEAT_COLUMN]] / capacity, amounts
                )
                if np.abs(reached_celsius - celsius).max() < TEMPERATURE_TOLERANCE_K:
                    break
                celsius = 0.5 * (celsius + reached_celsius)
                amounts, extents_done = self.reactions.react(every_amount[wet_rows], celsius)
            every_amount[wet_rows] = amounts
            extents[wet_rows] += extents_done
        if self.warmth.followed:
            self._boil_or_freeze(index, volume[:, 0], every_amount)

    def _clip_celsius(self, celsius: FloatArray, amounts: FloatArray) -> FloatArray:
        return np.clip(celsius, self.freezing_point_c(amounts), self.warmth.room + self.warmth.most)

    def _boil_or_freeze(self, index: int, volume: FloatArray, amounts: FloatArray) -> None:
        """Keep rows between freezing and boiling, in place: what would lead beyond makes steam or ice."""
        heat, latent = self.column[HEAT_COLUMN], self.column[LATENT_HEAT_COLUMN]
        capacity = np.asarray(self.capacity(index, volume, amounts))
        total_heat = amounts[:, heat] + amounts[:, latent]
        lowest_heat = np.where(volume > 0.0, (self.freezing_point_c(amounts) - self.warmth.room) * capacity, -np.inf)
        # What keeps no heat, or never boils, has no bound: infinity times nothing would be no number.
        highest_heat = np.full(len(capacity), np.inf)
        can_boil = (volume > 0.0) & (capacity > 0.0) & np.isfinite(self.warmth.most)
        np.multiply(capacity, self.warmth.most, out=highest_heat, where=can_boil)
        # At one of these it stays until all steam or ice is gone. What was brought hotter or colder stays as it is.
        amounts[:, heat] = np.clip(total_heat, np.minimum(lowest_heat, highest_heat), highest_heat)
        amounts[:, latent] = total_heat - amounts[:, heat]

    def _moving_heat(self, source: int, volume_ml: float) -> FloatArray:
        """Fractions (columns,) that move with all of the liquid: the vessel and solids that stay keep their heat."""
        amounts = self.amounts[source]
        solid, dissolved = self.heats.capacities(amounts)
        liquid_capacity, moving_capacity = (
            self.heats.liquid(volume_ml, amounts) + dissolved,
            self.solid_fraction * solid,
        )
        total_capacity, brought_capacity = (
            liquid_capacity + solid + self.glass[source],
            amounts[self.column[HEAT_CAPACITY_COLUMN]],
        )
        moving = self.moving.copy()
        moving[self.column[HEAT_COLUMN]] = (
            (liquid_capacity + moving_capacity) / total_capacity if total_capacity > 0.0 else 1.0
        )
        moving[self.column[HEAT_CAPACITY_COLUMN]] = (
            (brought_capacity - solid + moving_capacity) / brought_capacity if brought_capacity > 0.0 else 1.0
        )
        return moving

    def _exchange_heat(self, index: int, seconds: float) -> None:
        capacity = float(self.capacity(index, self.volume_ml[index], self.amounts[index]))
        if capacity > 0.0:
            heat, power_w = self.column[HEAT_COLUMN], float(self.power_w[index])
            joule = float(self.amounts[index, heat])
            self.amounts[index, heat] = (
                capacity * self.excess_after_seconds(index, joule / capacity, seconds, power_w, capacity)
                if power_w > 0.0
                else temperature_after_seconds(joule, seconds, capacity=capacity, loss=float(self.loss[index]))
            )

    def _reacts_slowly(self, index: int, flow_ends: Sequence[tuple[int, int]]) -> bool:
        """Whether a slow process goes on in a vessel, or could with what comes."""
        amounts_together = self.amounts[index] + sum(self.amounts[a] for a, b in flow_ends if b == index)
        return (
            bool(self.slow)
            and index != self.at[""]
            and bool(self.pending_extents(amounts_together, self._celsius_now(index)).any())
        )

    def _note_state(self, index: int, frame: int, time: float) -> None:
        self._blocks[index].append((np.array([time]), np.array([frame]), self.state[index : index + 1].copy()))
