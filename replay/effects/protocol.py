"""Definition of an effect: a spec that says all it will ask for, and a function that gets nothing else.

HOW TO WRITE AN EFFECT. One file ``replay/effects/<kind>.py`` (a hyphen becomes an underscore) that ends in a ``SPEC``,
and a table of its kind in ``replay/effects/catalogue.toml``. ``replay/effects/contact.py`` is a whole example::

    def compute(inputs: EffectInputs) -> EffectOutput:
        for declared in inputs.declared:                        # one per [[effect]] table of this kind, in order
            path = inputs.poses(declared["of"])            # BodyPoses: times, translation, rotation, valid, linked
            lip = path.point(inputs.body(declared["of"]).extra["cavity"]["lip"])    # (T, 3), NaN where no pose
        return EffectOutput(events=..., series=..., lanes=..., ran=..., liquids=..., data=...)

    SPEC = spec_of("lip", compute)

An effect of another package has no table there: it ends in an `EffectSpec` with its fields, ``{"of": Field("body", "a
vessel")}``. What the spec does not name cannot be had. ``Declaration`` hands the keys of an ``[[effect]]`` table out
checked, with defaults and with ids and ``tag:WORD`` as names of bodies. What one effect tells another goes through
``EffectOutput.data``. Effects of liquids are views of one account: `replay.effects.movement.movement_of` (who gave whom
how much, when) and `replay.effects.chemistry.matter.matter_of` (what is in each vessel).

The function gets `EffectInputs` and must not look at wall clocks, files or random numbers, nor create a detector: the
same inputs give the same bytes. It computes only where its ``trigger`` holds and says so in ``ran``
(``replay.effects.spans`` makes spans from masks). Times are seconds on the clock of ``inputs.times``. Nothing is
written by the effect; picture, tables and report are made from the `EffectOutput`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from replay.effects import CATALOGUE
from replay.effects.declaring import Declaration, Field, field_of
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectOutput
from sessions.model.scene import Scene

POSES_TOPIC: Final = "/tf"
"""The topic of poses, which every effect reads."""


@dataclass(frozen=True, eq=False)
class EffectSpec:
    """All that is known of an effect without running it; the module's docstring says how to write one."""

    kind: str  # the word in a scene; lower case, hyphens
    about: str  # one line for the plan and the report
    compute: Callable[[EffectInputs], EffectOutput]  # from inputs to output
    fields: Mapping[str, Field] = field(default_factory=dict)  # keys of its ``[[effect]]`` table
    results: Mapping[str, int] = field(default_factory=dict)  # event that heads a run -> its rank, 1 the weightiest
    retired: Mapping[str, str] = field(default_factory=dict)  # key or word of older scenes -> what to write instead
    # needs: kinds it cannot do without, in the plan because this one is. uses: kinds it builds on when the plan holds
    # them anyway. Both run before it: ``inputs.output(kind)``, of a used one where ``inputs.outputs`` has it.
    needs: tuple[str, ...] = ()
    # kind -> a field, and its values with which the kind is needed; no values: where the field is left out
    needs_if: Mapping[str, Sequence[object]] = field(default_factory=dict)
    uses: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()  # topics beyond the poses: ``HANDS`` gives ``inputs.hand_of(body)``
    # row of the table of detectors that looks at its pairs, for ``inputs.contact(pair)``; ``""``: none. One that needs
    # an effect with a detector has its pairs looked at too.
    detector: str = ""
    trigger: str = ""  # what gates it, in words; ``""``: it runs in every frame
    sources: tuple[str, ...] = ()  # citations
    single: str = ""  # field by which tables are of one thing: then they may differ in bodies and pairs alone
    check: Callable[[Declaration, Scene], None] | None = None  # refuses a combination of fields
    # refuses what tables of several kinds, and the bodies, do not make together; ``str``: the scene's file
    check_all: Callable[[Mapping[str, tuple[Declaration, ...]], Scene, str], None] | None = None

    def needed_kinds(self, declared: tuple[Declaration, ...]) -> tuple[str, ...]:
        """Kinds needed by these declarations; without any, those needed always."""
        kinds = [*self.needs]
        for kind, (key, *values) in self.needs_if.items():
            if any(table[str(key)] in (values or [None]) for table in declared):
                kinds.append(kind)
        return tuple(dict.fromkeys(kinds))


def spec_of(kind: str, compute: Callable[[EffectInputs], EffectOutput], **checks: Any) -> EffectSpec:
    """The spec of an effect of the catalogue, with its function and what refuses its tables."""
    entry = CATALOGUE[kind]
    rest: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()}
    rest["fields"] = {key: field_of(row) for key, row in entry["fields"].items()}
    return EffectSpec(kind, compute=compute, **rest, **checks)
