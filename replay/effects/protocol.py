"""What an effect is: a spec that says all it will ask for, and a function that gets nothing else.

HOW TO WRITE AN EFFECT. One file ``replay/effects/<kind>.py`` (a hyphen becomes an underscore) that ends in a ``SPEC``,
and one row in ``replay.effects.EFFECTS``. ``replay/effects/contact.py`` is a whole example::

    def compute(inputs: EffectInputs) -> EffectOutput:
        for declared in inputs.declared:                        # one per [[effect]] table of this kind, in order
            for name in declared.bodies("from"):
                path = inputs.poses(name)                       # BodyPoses: times, translation, rotation, valid, linked
                lip = path.point(inputs.body(name).extra["cavity"]["lip"])      # (T, 3) world, NaN where no pose
                ...
        return EffectOutput(events=..., series=..., lanes=..., ran=..., liquids=..., data=...)

    SPEC = EffectSpec(
        kind="pour", about="Liquid leaves a tilted vessel.", compute=compute,
        fields={"from": bodies("vessels that may pour"), "into": bodies("vessels that may receive", required=False)},
        trigger="a vessel tilted beyond the angle at which its liquid reaches the lip",
        sources=("Volume kept by a tilted cylinder: derived in models/sliced.py",),
    )

The spec (`EffectSpec`) is data, and what it does not name cannot be had:

- ``fields``: the TOML keys of its ``[[effect]]`` table, made with ``pairs bodies body number text flag vector mapping``
  of ``replay.effects.declaring`` (kind, unit, bounds, default). ``Declaration`` hands them out checked, defaults filled
  in, selectors (ids and ``tag:WORD``) resolved to body names. A key no field names is refused with the nearest one.
  A constant is a field without a default (the author's) or a default whose ``source`` is written beside it.
  ``check(declared, scene)`` may refuse a combination: ``raise declared.fail("...")``, ``check_all(tables, scene,
  file)`` what the tables of several kinds do not make together, such as a solid that no reaction makes.
- ``needs``: kinds whose outputs it cannot do without: they are in the plan because this one is. Write
  ``Need("pour", when="of", equals=("dilution",))`` where that depends on a field. ``uses``: kinds it builds on when the
  plan holds them anyway (``mixing`` uses ``pour`` and ``burette``, whichever is declared). Both run before it;
  ``inputs.output(kind)`` is their `EffectOutput`, ``inputs.has(kind)`` whether a used one is there. What one effect
  tells another goes through ``EffectOutput.data``, a frozen dataclass of the telling effect's file, which ``needs``
  has imported anyway, or of a module of models that both share.
- Effects of liquids are views of one account: `replay.effects.movement.movement_of` (who gave whom how much, when) and
  `replay.effects.matter.matter_of` (what is in each vessel); ``inputs.shared`` makes each once, from ``inputs.tables``.
- ``properties``: keys of its own in a body's ``properties``; others must stand in ``replay.effects.declaring``.
- ``reads``: topics beyond the poses: ``HANDS`` gives ``inputs.hand_of(body)``. Others are never decoded.
- ``detector``: name of the detector whose verdicts on the effect's pairs it reads with ``inputs.contact(pair)``; empty
  for most: pouring, mixing and reactions make no collision query. An effect that needs one with a detector (``grasp``
  needs ``contact``) has its own pairs looked at too.
- ``trigger``: words for what gates it. The function computes only in those spans and says so in ``EffectOutput.ran``,
  (T,) bool; frames left out are counted and shown as a lane. ``replay.effects.spans`` makes spans from masks.
- ``sources``: citations of the model and its constants; reports print them.

The function gets `EffectInputs`: ``inputs.times`` (T,) seconds and ``inputs.stamp_ns`` (T,) of the frames,
``declared``, ``pairs``, ``scene``, ``body(name)`` (declared: ``.extra["mass"]``, ``["cavity"]``, ``["properties"]``),
``poses(name)``, ``mesh(name)``, ``output``, ``has``, ``hand_of``, ``contact``, and ``count(name, n)`` for its work
counters. Only bodies that some declared effect names can be asked for. It must not look at wall clocks, files or random
numbers, and must not create a detector: the same inputs give the same bytes.

It returns `EffectOutput`: ``events`` (moments, or spans with an end; a world ``point`` becomes a marker),
``series`` (name such as ``flask/volume`` -> `Series` with unit), ``lanes`` (name -> spans with a word), ``ran``,
``liquids`` (body -> `Liquid`: level and colour drawn in the glass), ``data``. Times are seconds on the clock of
``inputs.times``. Nothing is written by the effect; picture, tables and report are made from the output.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from replay.effects.declaring import Declaration, Field
from replay.effects.inputs import HANDS, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Liquid, Series
from sessions.model.scene import Scene

__all__ = [
    "HANDS",
    "Declaration",
    "EffectEvent",
    "EffectInputs",
    "EffectOutput",
    "EffectSpec",
    "LaneSpan",
    "Liquid",
    "Need",
    "Series",
]

POSES: Final = "/tf"
"""The topic of poses, which every effect reads."""


@dataclass(frozen=True)
class Need:
    """A kind that is needed only where a field of the declaration has one of some values."""

    kind: str  # the effect needed
    when: str = ""  # field that decides, ``""``: always
    equals: tuple[object, ...] = ()  # values of the field with which it is needed

    def holds(self, declared: Declaration) -> bool:
        """Whether this declaration needs it."""
        return not self.when or declared.values.get(self.when) in self.equals


@dataclass(frozen=True, eq=False)
class EffectSpec:
    """All that is known of an effect without running it; the module's docstring says how to write one."""

    kind: str  # the word in a scene; lower case, hyphens
    about: str  # one line for the plan and the report
    compute: Callable[[EffectInputs], EffectOutput]  # from inputs to output
    fields: Mapping[str, Field] = field(default_factory=dict)  # keys of its ``[[effect]]`` table
    # needs, uses: kinds it cannot do without, and kinds it builds on when they are in the plan anyway
    needs: tuple[str | Need, ...] = ()
    uses: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()  # topics beyond the poses
    properties: tuple[str, ...] = ()  # keys of a body's ``properties`` that no other effect reads
    detector: str = ""  # row of the table of detectors that looks at its pairs, ``""``: none
    trigger: str = ""  # what gates it, in words; ``""``: it runs in every frame
    sources: tuple[str, ...] = ()  # citations
    check: Callable[[Declaration, Scene], None] | None = None  # refuses a combination of fields
    # refuses what tables of several kinds, and the bodies, do not make together; ``str``: the scene's file
    check_all: Callable[[Mapping[str, tuple[Declaration, ...]], Scene, str], None] | None = None

    def needed(self, declared: tuple[Declaration, ...]) -> tuple[str, ...]:
        """Kinds needed by these declarations; without any, those needed always."""
        needs = [need if isinstance(need, Need) else Need(need) for need in self.needs]
        return tuple(
            dict.fromkeys(n.kind for n in needs if not n.when or any(n.holds(declaration) for declaration in declared))
        )
