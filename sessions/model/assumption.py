"""Assumptions of an import: what the numbers of its files were taken to mean, and who says so."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

from sessions.errors import SessionError
from sessions.meshes.conventions import CONVENTIONS, Convention, convention

ASSUMPTIONS_FACT: Final = "assumptions"
"""The fact of a recording that holds its assumptions as JSON."""


class Subject(StrEnum):
    """The thing that is assumed."""

    POSE_AXES = "axes of poses"
    HANDEDNESS = "handedness"
    LENGTH_UNIT = "unit of lengths"
    TIME_UNIT = "unit of times"
    CLOCK = "clock"
    COLUMNS = "columns"
    QUATERNION_ORDER = "quaternion order"
    EULER_ORDER = "Euler order"
    ANGLE_UNIT = "unit of angles"
    MESH_AXES = "axes of meshes"
    MESH_UNIT = "unit of meshes"
    COLLIDER_AXES = "axes of colliders"
    JOINT_RADII = "radii of joints"
    SURFACE = "geometry of the surface"


DRAFTED: Final = (
    Subject.COLUMNS,
    Subject.CLOCK,
    Subject.TIME_UNIT,
    Subject.QUATERNION_ORDER,
    Subject.EULER_ORDER,
    Subject.ANGLE_UNIT,
)
"""What the draft of a mapping guesses, and the unit of angles that is in none."""


class Origin(StrEnum):
    """Who says it."""

    FILE = "the file says it"
    FORMAT = "the format defines it"
    GUESS = "guessed"
    USER = "you said it"
    NOT_KNOWN = "not known"


class Confidence(StrEnum):
    """How sure a guess is; ``OPEN`` ones are asked where they change the answer."""

    SURE = "sure"
    OPEN = "open"


@dataclass(frozen=True)
class Assumption:
    """One thing that was assumed of a source.

    Parameters
    ----------
    value : what it was taken for, as the option takes it.
    bodies : whose meshes it is about; none: the whole recording.
    files : the mesh files it is about.
    description : the value in words, where its name does not say enough.
    reason : why it was guessed.
    alternatives : values that it may have instead; the one it has is among them.
    guessed_value : the value before a user answered; ``""``: nobody answered.
    guessed_origin : who said that value.
    """

    subject: Subject
    value: str
    origin: Origin
    confidence: Confidence = Confidence.SURE
    bodies: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    description: str = ""
    reason: str = ""
    alternatives: tuple[str, ...] = ()
    guessed_value: str = ""
    guessed_origin: Origin = Origin.GUESS

    @property
    def is_open(self) -> bool:
        """Whether nobody decided between its alternatives."""
        unsure = self.origin is Origin.NOT_KNOWN or (self.origin is Origin.GUESS and self.confidence is Confidence.OPEN)
        return unsure and len(self.alternatives) > 1

    @property
    def title(self) -> str:
        """The subject: ``axes of beaker.obj and rod.obj``."""
        if not self.files:
            return self.title_by_bodies
        *first, last = self.files
        what = "unit" if self.subject is Subject.MESH_UNIT else "axes"
        return f"{what} of {', '.join(first)}{' and ' if first else ''}{last}"

    @property
    def title_by_bodies(self) -> str:
        """The same without names of files, which may be those of people: ``axes of the meshes of beaker and rod``."""
        if not self.bodies:
            return str(self.subject)
        *first, last = self.bodies
        return f"{self.subject} of {', '.join(first)}{' and ' if first else ''}{last}"

    @property
    def sentence(self) -> str:
        """The value and who says it: ``unity (left-handed, +Y up); guessed: Unity's own axes``."""
        value = self.value
        if self.description.startswith(self.value):
            value = self.description
        elif self.description:
            value = f"{self.value} ({self.description})"
        origin = str(self.origin)
        if self.origin is Origin.GUESS:
            origin = f"guessed{'' if self.confidence is Confidence.SURE else ', not sure'}"
        because = f": {self.reason}" if self.reason and self.origin is not Origin.USER else ""
        return f"{value}; {origin}{because}"

    def answered(self, value: str, description: str = "") -> "Assumption":
        """Returns the assumption as a user decided it."""
        guess = self if not self.guessed_value else self.unanswered()
        return replace(
            self,
            value=value,
            description=description,
            origin=Origin.USER,
            guessed_value=guess.value,
            guessed_origin=guess.origin,
        )

    def unanswered(self, description: str = "") -> "Assumption":
        """Returns an assumption that a user decided as it was before."""
        return replace(
            self,
            value=self.guessed_value,
            description=description,
            origin=self.guessed_origin,
            guessed_value="",
            guessed_origin=Origin.GUESS,
        )

    def as_json(self) -> dict[str, Any]:
        """Returns the fields that hold something."""
        fields = {key: value for key, value in vars(self).items() if value}
        if not self.guessed_value:
            del fields["guessed_origin"]
        return fields


def assumptions_fact(assumptions: Iterable[Assumption]) -> str:
    """Returns the text that a recording keeps of assumptions."""
    return json.dumps([row.as_json() for row in assumptions], ensure_ascii=False)


def assumptions_of(facts: Mapping[str, str]) -> tuple[Assumption, ...] | None:
    """Returns the assumptions that a recording keeps; ``None``: it keeps none.

    Raises SessionError: the text is not what `assumptions_fact` writes.
    """
    text = facts.get(ASSUMPTIONS_FACT)
    if text is None:
        return None
    try:
        return tuple(_assumption(row) for row in json.loads(text))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise SessionError(f"the assumptions of the recording cannot be read ({error}); import it again") from None


def _assumption(row: Mapping[str, Any]) -> Assumption:
    return Assumption(
        subject=Subject(row["subject"]),
        origin=Origin(row["origin"]),
        confidence=Confidence(row.get("confidence", Confidence.SURE)),
        value=str(row.get("value", "")),
        bodies=_texts(row, "bodies"),
        files=_texts(row, "files"),
        description=str(row.get("description", "")),
        reason=str(row.get("reason", "")),
        alternatives=_texts(row, "alternatives"),
        guessed_value=str(row.get("guessed_value", "")),
        guessed_origin=Origin(row.get("guessed_origin", Origin.GUESS)),
    )


def _texts(row: Mapping[str, Any], key: str) -> tuple[str, ...]:
    return tuple(map(str, row.get(key, ())))


def pose_convention(facts: Mapping[str, str]) -> Convention:
    """Returns the convention that the poses of a recording had in their source; the canonical one if none is kept."""
    for row in assumptions_of(facts) or ():
        if row.subject is Subject.POSE_AXES:
            return convention(row.value)
    return CONVENTIONS["canonical"]


def grouped_assumptions(rows: Iterable[Assumption]) -> list[Assumption]:
    """Returns assumptions that differ in nothing but body and file as one."""
    merged: dict[Assumption, Assumption] = {}
    for row in rows:
        key = replace(row, bodies=(), files=())
        before = merged.get(key, key)
        merged[key] = replace(
            row, bodies=before.bodies + row.bodies, files=tuple(dict.fromkeys(before.files + row.files))
        )
    return list(merged.values())
