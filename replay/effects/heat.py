"""A flame heats what stands over it; an acid heats the water it is diluted with; the wrong order is named."""

from __future__ import annotations

from replay.effects.declaring import Declaration, body, number, text, vector
from replay.effects.dilution import diluted
from replay.effects.flame_heating import heated
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectOutput, Findings
from replay.effects.protocol import EffectSpec, Need
from sessions.model.scene import Scene

WANTED = {
    "flame": ("source", "heats", "within", "power_w", "base"),
    "dilution": ("solute", "heat_j_mol", "half_water", "heat_capacity_j_per_ml_k"),
}
"""Fields that each kind of heat cannot do without."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``heated``, ``boil``, ``wrong-order``; temperatures as series."""
    parts = [(heated if declared.text("of") == "flame" else diluted)(inputs, declared) for declared in inputs.declared]
    found = Findings(len(inputs))
    for part in parts:
        assert part.ran is not None
        found.ran |= part.ran
        found.events += part.events
        found.series.update(part.series)
        found.lanes.update({name: list(spans) for name, spans in part.lanes.items()})
    return found.output() if parts else EffectOutput()


def _check(declared: Declaration, _scene: Scene) -> None:
    kind = declared.text("of")
    for key in WANTED[kind]:
        if declared.values[key] is None:
            raise declared.fail(f"{key} is missing: heat of a {kind} needs {', '.join(WANTED[kind])}")
    for other in set(WANTED) - {kind}:
        for key in WANTED[other]:
            if declared.values[key] is not None:
                raise declared.fail(f"{key} belongs to heat of a {other}, and this is of a {kind}; leave it out")


SPEC = EffectSpec(
    kind="heat",
    about="A flame or a dilution heats.",
    compute=compute,
    needs=(Need("mixing", "of", ("dilution",)),),
    fields={
        "of": text("what gives the heat", among=tuple(WANTED)),
        "ambient_c": number("of the room and of everything at first", "degC", above=-273.15),
        "loss_w_per_k": number("heat lost per kelvin above the room", "W/K", least=0.0),
        "boils_c": number("reaching it is an event; what boils off is not computed", "degC", default=None),
        "source": body("the lamp", required=False),
        "heats": body("what is heated; properties.heat_capacity_j_per_k", required=False),
        "base": vector("foot of the flame in the lamp's frame", default=None),
        "within": number("heated nearer than this to the flame's axis", "m", default=None, above=0.0),
        "power_w": number("heat that reaches it", "W", default=None, least=0.0),
        "solute": text("the acid", default=None),
        "heat_j_mol": number("heat of dilution of one mol in much water", "J/mol", default=None),
        "half_water": number("mol of water per mol of acid that give half of it", "", default=None, above=0.0),
        "heat_capacity_j_per_ml_k": number("of the liquids", "J/(mL K)", default=None, above=0.0),
    },
    trigger="the body over the flame and the time after, or liquid that is mixed and the time after",
    sources=(
        "m c dT/dt = P - k (T - Ta), closed form from frame to frame; constants: the scene's author",
        "heat of dilution a n / (n + b) per mol of acid in n mol of water (form of J. Thomsen); constants the author's",
        "acid into water: a more concentrated acid is poured into a weaker one, never the other way round",
    ),
    check=_check,
)  # fmt: skip
