"""A session with less of a person in it: what is kept is listed here, and everything else is left out.

Motion itself still identifies people, so the result is personal data all the same.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from replay.effects import load_effect
from replay.effects.effect_plan import plan
from replay.errors import ReplayError
from sessions import Event, Frames, Interval, Scene, Session, Track
from sessions.errors import SessionError
from sessions.meshes.conventions import CONVENTIONS
from sessions.meshes.mesh_axes import BODY, MESH_ROTATIONS
from sessions.meshes.mesh_match import UNITS
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Subject, assumptions_fact
from sessions.model.scene import SceneBody, SceneEffect, SceneGroup
from sessions.names import HAND_TOKENS, HEAD_TOKENS, SIDES, name_tokens
from sessions.scene_files.answers import recording_assumptions

EPOCH_NS: Final = 946_684_800 * 10**9
"""When every minimised recording begins: 2000-01-01 00:00 UTC."""
MOST_STAMP_DISTANCE_NS: Final = 3600 * 10**9
"""A device stamp further from its frame is of another clock, which would say when it was; the frame's stands for it."""
ROLE_NAMES: Final = HEAD_TOKENS | HAND_TOKENS | {*SIDES, "glass", "bench", "rod"}
"""Words of names and tags that the tool itself reads: they may stay."""
KEPT_INTERVAL_KINDS: Final = ("task", "stage", "feature")
KEPT_FACTS: Final = {
    "source_units": ("m", "cm", "mm"),
    "handedness": ("right", "left"),
    "consent": ("none", "lab", "share"),
    "vr_type": ("immersive", "augmented", "distributed", "desktop"),
}
"""Facts that stay where they hold one of these words."""
KNOWN_AXES: Final = frozenset((*CONVENTIONS, *MESH_ROTATIONS, BODY))
"""Names of axes, which are no words of a user."""
KNOWN_VALUES: Final = {
    Subject.POSE_AXES: KNOWN_AXES,
    Subject.MESH_AXES: KNOWN_AXES,
    Subject.COLLIDER_AXES: KNOWN_AXES,
    Subject.MESH_UNIT: UNITS,
    Subject.LENGTH_UNIT: UNITS,
}
"""Assumptions that stay, and the values that are no words of a user."""


@dataclass(frozen=True)
class _ShiftedFrames:
    """The frames of a session on the new clock, under the new names, block by block."""

    session: Session
    names: tuple[str, ...]
    later_ns: int

    def blocks(self, frames: int) -> Iterator[Frames]:
        for block in self.session.blocks(frames):
            stamp, sample = block.stamp_ns + self.later_ns, block.sample_ns + self.later_ns
            is_of_another_clock = np.abs(sample - stamp[:, None]) > MOST_STAMP_DISTANCE_NS
            sample = np.where(is_of_another_clock, stamp[:, None], sample)
            yield replace(block, names=self.names, stamp_ns=stamp, log_ns=stamp.copy(), sample_ns=sample)


def pseudonym(kind: str, name: str) -> str:
    """The same word for the same name in every file, so that tables can group by it; none for no name."""
    return f"{kind}-{hashlib.sha256(f'{kind} {name}'.encode()).hexdigest()[:8]}" if name else ""


def minimise(session: Session) -> Session:
    """Poses, meshes, scene, when events, tasks and stages were, and some facts, under new names and on a new clock."""
    first_stamp = next((int(block.stamp_ns[0]) for block in session.blocks(1) if len(block)), EPOCH_NS)
    shift_ns = EPOCH_NS - first_stamp
    new_name_of = _numbered_names([*session.names, *(body.id for body in session.scene.bodies), *session.meshes])
    facts = {key: session.facts[key] for key, allowed in KEPT_FACTS.items() if session.facts.get(key) in allowed}
    assumptions = _open_assumptions(session, new_name_of)
    if assumptions:
        facts[ASSUMPTIONS_FACT] = assumptions_fact(assumptions)
    stated_pseudonym = session.facts.get("pseudonym", "not stated")
    return Session(
        _ShiftedFrames(session, tuple(new_name_of[name] for name in session.names), shift_ns),
        {new_name_of[name]: mesh for name, mesh in session.meshes.items()},
        _renamed_scene(session.scene, new_name_of),
        tuple(
            Event(event.time_ns + shift_ns, pseudonym("event", event.name), body=new_name_of.get(event.body, ""))
            for event in session.events
        ),
        tuple(_renamed_interval(interval, shift_ns) for interval in session.intervals),
        facts | ({} if stated_pseudonym == "not stated" else {"pseudonym": pseudonym("participant", stated_pseudonym)}),
        colliders={new_name_of[name]: solids for name, solids in session.colliders.items() if name in new_name_of},
        fast_tracks={
            new_name_of[name]: Track(track.times_ns + shift_ns, track.positions, track.quaternions_xyzw, track.valid)
            for name, track in session.fast_tracks.items()
            if name in new_name_of
        },
    )


def _open_assumptions(session: Session, new_name_of: Mapping[str, str]) -> list[Assumption]:
    """Open guesses of an import, with the axes of the poses; no file and no text of a user."""
    rows = recording_assumptions(session)
    if not any(row.is_open for row in rows):
        return []
    kept_assumptions = []
    for row in rows:
        if row.value in KNOWN_VALUES.get(row.subject, ()):
            bodies = tuple(new_name_of[name] for name in row.bodies if name in new_name_of)
            kept_assumptions.append(replace(row, bodies=bodies, files=(), reason="", guessed_value=""))
    return kept_assumptions


def _numbered_names(old_names: Iterable[str]) -> dict[str, str]:
    """Old name -> new one, of the words in ROLES and a number."""
    new_names: dict[str, str] = {}
    for name in dict.fromkeys(old_names):
        tokens = name_tokens(name)
        new_names[name] = "-".join(
            [*dict.fromkeys(word for word in tokens if word in ROLE_NAMES), f"body-{len(new_names) + 1}"]
        )
    return new_names


def _renamed_interval(interval: Interval, shift_ns: int) -> Interval:
    kind = interval.kind if interval.kind in KEPT_INTERVAL_KINDS else pseudonym("kind", interval.kind)
    return Interval(interval.start_ns + shift_ns, interval.end_ns + shift_ns, kind, pseudonym(kind, interval.name))


def _renamed_scene(scene: Scene, new_name_of: Mapping[str, str]) -> Scene:
    """The scene with the new names, without texts and paths, and without effects that need any."""
    groups = {group: f"group-{k}" for k, group in enumerate(dict.fromkeys(body.group for body in scene.bodies), 1)}
    renamed_scene = Scene(
        name=pseudonym("scene", scene.name),
        bodies=tuple(_renamed_body(body, new_name_of, {**groups, "": ""}) for body in scene.bodies),
        pairs=None if scene.pairs is None else _renamed_pairs(scene.pairs, new_name_of),
        groups=tuple(
            SceneGroup(f"thing-{number}", tuple(new_name_of[member] for member in group.members))
            for number, group in enumerate(scene.groups, 1)
        ),
        ignore=_renamed_pairs(scene.ignore, new_name_of),
        space_radius=scene.space_radius,
    )
    effects = [_renamed_effect(effect, renamed_scene, new_name_of) for effect in scene.effects or ()]
    return renamed_scene if scene.effects is None else replace(renamed_scene, effects=tuple(filter(None, effects)))


def _renamed_pairs(pairs: Iterable[tuple[str, str]], new_name_of: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    return tuple((new_name_of[a], new_name_of[b]) for a, b in pairs)


def _renamed_body(body: SceneBody, new_name_of: Mapping[str, str], groups: Mapping[str, str]) -> SceneBody:
    mass = {key: value for key, value in body.extra.items() if key == "mass" and isinstance(value, int | float)}
    tags = tuple(tag for tag in body.tags if tag in ROLE_NAMES)
    renamed_body = replace(
        body, id=new_name_of[body.id], group=groups[body.group], parent=new_name_of.get(body.parent, ""), tags=tags
    )
    return replace(renamed_body, mesh="", node="", scale=1.0, mesh_axes="", extra=mass)


def _renamed_effect(effect: SceneEffect, scene: Scene, new_name_of: Mapping[str, str]) -> SceneEffect | None:
    """The effect with the new names; ``None`` where it says words of its own or needs what the scene lost."""

    def rename_value(value: Any) -> Any:
        if isinstance(value, str):
            return value if value in fixed_tokens or value.removeprefix("tag:") in ROLE_NAMES else new_name_of[value]
        return [rename_value(item) for item in value] if isinstance(value, list | tuple) else float(value)

    try:
        fixed_tokens = {word for field in load_effect(effect.kind).fields.values() for word in field.among}
        renamed_effect = SceneEffect(effect.kind, {key: rename_value(value) for key, value in effect.settings.items()})
        plan(replace(scene, effects=(renamed_effect,)))
    except (KeyError, TypeError, ReplayError, SessionError):
        return None
    return renamed_effect
