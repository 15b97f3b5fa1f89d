"""A salt falls out as soon as its ion product exceeds its solubility product, and as much of it as evens the two."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from replay.effects.declaring import Declaration, mapping, number, text
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Series
from replay.effects.protocol import EffectSpec
from replay.effects.reaction import Reacted
from replay.effects.vessels import COLOURS, WATERY, blended

HALVINGS = 200
"""Of the logarithm of what stays dissolved, between 1e-300 and all: more than doubles tell apart."""

LEAST = 1e-300
"""Where the search for what stays dissolved begins: near the least float, since a logarithm has no zero."""


def amount_fallen(
    amounts: Mapping[str, FloatArray], exponents: Mapping[str, float], litres: FloatArray, product: float
) -> FloatArray:
    """Mol (n,) of solid from mol (n,) of each ion brought into ``litres`` (n,).

    ``exponents``: ion -> how often it is in one formula of the solid; same names as ``amounts``.
    ``product``: solubility product in mol/L to the sum of the exponents, above 0.
    """
    ions = list(exponents)
    powers = np.array([exponents[ion] for ion in ions])[:, None]
    there = np.stack([np.maximum(0.0, amounts[ion]) for ion in ions]) / powers
    least = there.min(axis=0)
    excess = there - least
    volume = np.where(litres > 0.0, litres, np.inf)
    # Searched for is what stays of the scarcest ion, on a logarithmic scale: all but a billionth of it falls out, and
    # the small rest, found as a difference, would have no digits.
    low, high = np.full(len(litres), np.log(LEAST)), np.log(np.maximum(least, LEAST))
    goal = np.log(product)
    dissolved = _log_product(high, excess, powers, volume) <= goal
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        over = _log_product(middle, excess, powers, volume) > goal
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    fallen = least - np.exp(0.5 * (low + high))
    return np.asarray(np.where(dissolved | (least <= LEAST) | (litres <= 0.0), 0.0, np.maximum(0.0, fallen)))


def _log_product(log_left: FloatArray, excess: FloatArray, powers: FloatArray, volume: FloatArray) -> FloatArray:
    left = powers * (excess + np.exp(log_left))
    with np.errstate(divide="ignore"):
        return np.asarray((powers * (np.log(left) - np.log(volume))).sum(axis=0))


CLOUDY_MOL_L = 1e-3
"""Solid per litre that is drawn as fully cloudy; chosen by us, for the picture only."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Event ``precipitate`` at the onset with the mass at the end; mass as a series; a cloudy liquid."""
    reacted: tuple[Reacted, ...] = inputs.output("reaction").data
    drawn = inputs.output("mixing").liquids
    found = Findings(len(inputs))
    for declared in inputs.declared:
        solid = declared.text("solid")
        for one in reacted:
            if solid not in one.equation.products:
                continue
            history = one.history
            amount = _fallen(declared, one)
            inputs.count("equilibria solved", len(amount))
            found.ran[history.frames] = True
            found.series[f"{one.vessel}/{solid}"] = Series(history.times, amount * declared.number("molar_mass"), "g")
            found.events += _onset(declared, one, amount)
            if one.vessel in drawn:
                litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.inf)
                cloud = blended(WATERY, COLOURS[declared.text("colour")], amount / litres / CLOUDY_MOL_L)
                found.liquids[one.vessel] = replace(drawn[one.vessel], rgba=cloud)
    return found.output()


def _fallen(declared: Declaration, one: Reacted) -> FloatArray:
    parts = one.equation.products[declared.text("solid")]
    supplied = declared.mapping("ions")
    amounts: dict[str, FloatArray] = {}
    exponents: dict[str, float] = {}
    for formula, coefficient in one.equation.reagents.items():
        ions = float(supplied.get(formula, 1))
        exponent = ions * coefficient / parts
        if exponent != round(exponent):
            raise declared.unmet(
                f"{coefficient} {formula} for {parts} {declared.text('solid')} "
                f"gives {exponent:g} ions per formula; say under ions how many each {formula} brings"
            )
        amounts[formula] = ions * one.history.amount(formula)
        exponents[formula] = exponent
    return amount_fallen(amounts, exponents, one.history.volume_ml * 1e-3, declared.number("ksp"))


def _onset(declared: Declaration, one: Reacted, amount: FloatArray) -> list[EffectEvent]:
    rows = np.flatnonzero(amount > 0.0)
    if not len(rows):
        return []
    solid, mass = declared.text("solid"), float(amount.max() * declared.number("molar_mass"))
    time = float(one.history.times[rows[0]])
    values: dict[str, float | int | str | bool] = {"mass_g": mass, "moles": float(amount.max()), "formula": solid}
    words = f"{solid} falls out in {one.vessel}: {mass:.3g} g, {declared.text('colour')}"
    return [EffectEvent(time, "precipitate", (one.vessel,), None, values, words)]


SPEC = EffectSpec(
    kind="precipitation",
    about="A salt falls out of solution.",
    compute=compute,
    needs=("mixing", "reaction"),
    fields={
        "solid": text("formula of the solid, a product of a declared reaction"),
        "ksp": number("solubility product", "mol/L to the number of ions", above=0.0),
        "molar_mass": number("of the solid", "g/mol", above=0.0),
        "colour": text("of the solid, for the picture", among=tuple(COLOURS)),
        "ions": mapping("reagent = ions of the solid that one formula of it brings; 1 where absent", default={}),
    },
    trigger="all reagents of a reaction that makes the solid in one vessel",
    sources=(
        "solubility product and molar mass: the scene's author",
        "equilibrium of the ion product, activities taken as concentrations; solids stay when liquid is poured off",
    ),
)
