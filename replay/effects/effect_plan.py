"""Plan of a scene: effects and all they need, pairs, bodies, topics and detectors. Nothing else runs.

Every item carries its reasons, so that a plan can be read: ``contact: because breakage needs it``.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from itertools import chain
from typing import Any, Final, TypeVar

from replay.effects import RETIRED_KINDS, effect_kinds, load_effect
from replay.effects.declaring import Declaration, Pair, body_faults, declare
from replay.effects.protocol import POSES_TOPIC, EffectSpec
from replay.errors import EffectError, PlanError, WrongInputError
from sessions.input_files import nearest
from sessions.model.scene import Scene

Key = TypeVar("Key")
Reasons = dict[Key, list[str]]
"""What a plan holds -> why."""

_Pairs = dict[frozenset[str], Pair]

DECLARED_REASON: Final = "the scene declares it"


@dataclass(frozen=True, eq=False)
class Step:
    """One effect of a plan."""

    spec: EffectSpec
    declared: tuple[Declaration, ...]  # its tables in the scene, none where it is there only because another needs it
    pairs: tuple[Pair, ...]  # its own pairs and those of the effects that need it
    inputs: tuple[str, ...]  # kinds whose outputs it gets
    because: Sequence[str]  # why it is in the plan


@dataclass(frozen=True, eq=False)
class Plan:
    """The work of a run for a scene."""

    steps: Mapping[str, Step]  # kind -> step, in running order: an effect comes after what it needs
    pairs: tuple[Pair, ...] | None  # pairs of body names to look at; ``None``: all with relative motion
    detection: bool  # whether any contact is looked for: not by a scene that declares effects and none that needs them
    # bodies, topics, detectors: name -> why it is needed
    bodies: Mapping[str, Sequence[str]] = field(default_factory=dict)
    topics: Mapping[str, Sequence[str]] = field(default_factory=dict)
    detectors: Mapping[str, Sequence[str]] = field(default_factory=dict)
    pair_reasons: Mapping[Pair, Sequence[str]] = field(default_factory=dict)  # pair -> effects that ask about it
    not_run: tuple[str, ...] = ()  # kinds there are that this plan leaves out

    @property
    def effects(self) -> tuple[str, ...]:
        """Kinds in running order: the declared ones and all they need."""
        return tuple(self.steps)


def plan(scene: Scene) -> Plan:
    """Say what a scene calls for.

    A scene without an effects table is audited: the plan asks for contacts. A scene that declares effects gets what
    they need and no more: a titration makes no collision query.

    Raises PlanError: an unknown effect, field, body or tag, or an unknown key of a body; the message has file, table,
    key and the nearest known name, ``faults`` are all there are.
    Raises EffectError: a declared effect whose file cannot be loaded.
    """
    if not isinstance(scene, Scene):
        raise WrongInputError(f"a scene is needed, not {type(scene).__name__}; a session has one: session.scene")
    faults: list[str] = []
    file = scene.file
    declared = _declare_tables(scene, file, faults)
    faults += body_faults(scene, file)
    if faults:
        raise PlanError(*faults)
    if scene.effects is None:
        return Plan({}, scene.pairs, detection=True, not_run=effect_kinds())
    specs, reasons_by_kind = _kinds_and_reasons(declared)
    tables_of_kind = {kind: declared.get(kind, ()) for kind in specs}
    for spec in specs.values():
        try:
            if spec.check_all is not None:
                spec.check_all(tables_of_kind, scene, file)
        except PlanError as error:
            faults += error.faults
    if faults:
        raise PlanError(*dict.fromkeys(faults))
    needed_kinds_by_kind = {kind: spec.needed_kinds(tables_of_kind[kind]) for kind, spec in specs.items()}
    inputs = {
        kind: tuple(dict.fromkeys((*needed_kinds_by_kind[kind], *(used for used in specs[kind].uses if used in specs))))
        for kind in sorted(specs)
    }
    try:
        running_order = tuple(TopologicalSorter(inputs).static_order())
    except CycleError as error:
        raise PlanError(f"effects need each other in a circle: {' -> '.join(error.args[1])}; break it") from error
    pairs: dict[str, _Pairs] = {kind: {} for kind in running_order}
    for kind in reversed(running_order):
        _add_pairs(pairs[kind], _values_of_kind(specs[kind], tables_of_kind[kind], "pairs"))
        for needed in needed_kinds_by_kind[kind]:
            _add_pairs(pairs[needed], pairs[kind].values())
    step_of_kind = {
        kind: Step(specs[kind], tables_of_kind[kind], tuple(pairs[kind].values()), inputs[kind], reasons_by_kind[kind])
        for kind in running_order
    }
    return _plan_of_steps(scene, step_of_kind)


def plan_faults(scene: Scene) -> tuple[str, ...]:
    """Everything because of which there is no plan for a scene; nothing where there is one."""
    try:
        plan(scene)
    except PlanError as error:
        return error.faults
    except EffectError as error:
        return (str(error),)
    return ()


def _declare_tables(scene: Scene, file: str, faults: list[str]) -> dict[str, tuple[Declaration, ...]]:
    tables_of_kind: dict[str, tuple[Declaration, ...]] = {}
    known_kinds = effect_kinds()
    for row, effect in enumerate(scene.effects or (), start=1):
        if effect.kind not in known_kinds:
            advice = RETIRED_KINDS.get(effect.kind)
            suggestion = f": {advice}" if advice else nearest(effect.kind, known_kinds)
            faults.append(f"{file}: [[effect]] {row}: no effect of kind {effect.kind!r}{suggestion}")
            continue
        spec = load_effect(effect.kind)
        try:
            declaration = declare(effect, row, spec.fields, scene, file, spec.retired)
            if spec.check is not None:
                spec.check(declaration, scene)
        except PlanError as error:
            faults += error.faults
            continue
        earlier_tables = tables_of_kind.get(effect.kind, ())
        faults += _differing_keys(declaration, earlier_tables, spec)
        # A table that stands there twice asks for nothing more.
        if all(table.values != declaration.values for table in earlier_tables):
            tables_of_kind[effect.kind] = (*earlier_tables, declaration)
    return tables_of_kind


def _differing_keys(
    new_declaration: Declaration, earlier_tables: tuple[Declaration, ...], spec: EffectSpec
) -> list[str]:
    """Names keys in which two tables of one thing differ."""
    tables_alike = [
        table for table in earlier_tables if spec.single and table[spec.single] == new_declaration.values[spec.single]
    ]
    return [
        str(
            new_declaration.fail(
                f"{key} is {new_declaration[key]!r} and {table.table} says {table[key]!r}; one {spec.kind} has one"
            )
        )
        for table in tables_alike[:1]
        for key, field_ in spec.fields.items()
        if field_.kind not in ("bodies", "pairs") and new_declaration[key] != table[key]
    ]


def _kinds_and_reasons(declared: Mapping[str, tuple[Declaration, ...]]) -> tuple[dict[str, EffectSpec], Reasons[str]]:
    specs: dict[str, EffectSpec] = {}
    reasons_by_kind: Reasons[str] = {kind: [DECLARED_REASON] for kind in declared}
    pending_kinds = sorted(declared)
    for kind in pending_kinds:  # it grows by what is needed
        if kind not in specs:
            specs[kind] = load_effect(kind)
            for needed in specs[kind].needed_kinds(declared.get(kind, ())):
                pending_kinds.append(needed)
                _note_reason(reasons_by_kind, needed, f"{kind} needs it")
    return specs, reasons_by_kind


def _values_of_kind(spec: EffectSpec, declared: tuple[Declaration, ...], kind: str) -> list[Any]:
    """Values that the tables of an effect give to fields of a kind; lists are laid out."""
    field_keys = [key for key, field in spec.fields.items() if field.kind == kind]
    given_values = [declaration[key] for declaration in declared for key in field_keys if declaration[key]]
    return given_values if kind == "body" else [value for values in given_values for value in values]


def _add_pairs(known_pairs: _Pairs, pairs: Iterable[Pair]) -> None:
    """Add pairs that are not there in either order of names."""
    for pair in pairs:
        known_pairs.setdefault(frozenset(pair), pair)


def _note_reason(reasons: Reasons[Any], key: Pair | str, reason: str) -> None:
    known_reasons = reasons.setdefault(key, [])
    if reason not in known_reasons:
        known_reasons.append(reason)


def _plan_of_steps(scene: Scene, steps: Mapping[str, Step]) -> Plan:
    known_pairs: _Pairs = {}
    pairs: Reasons[Pair] = {}
    bodies, topics, detectors = (Reasons[str]() for _ in range(3))
    pairs_by_asker = {"the scene's own pairs": scene.pairs or ()}
    for kind, step in steps.items():
        for topic in (POSES_TOPIC, *step.spec.reads):
            _note_reason(topics, topic, kind)
        single_bodies, body_lists = (_values_of_kind(step.spec, step.declared, field) for field in ("body", "bodies"))
        for name in (*chain(*step.pairs), *body_lists, *single_bodies):
            _note_reason(bodies, name, kind)
        if step.spec.detector:
            _note_reason(detectors, step.spec.detector, kind)
            pairs_by_asker[kind] = step.pairs
    for why, requested in pairs_by_asker.items():
        _add_pairs(known_pairs, requested)
        for pair in requested:
            _note_reason(pairs, known_pairs[frozenset(pair)], why)
    not_run = tuple(kind for kind in effect_kinds() if kind not in steps)
    return Plan(steps, tuple(pairs), bool(pairs), bodies, topics, detectors, pairs, not_run)
