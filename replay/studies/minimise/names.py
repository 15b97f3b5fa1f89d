"""Names that may stay: those made of words of the laboratory. Every other name gets a new one, of its known words."""

import re
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any, Final

from replay.effects import load_effect
from replay.effects.vessels import COLOURS
from sessions.glassware.catalogue import INSTRUMENTS
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect

_WORDS: Final = (
    "a b body hand left right wrist palm finger thumb head headset hmd eye gaze controller wand tracker camera foot "
    "room floor wall table bench chair shelf door box sphere cube ball plate block tool furniture glass plastic metal "
    "porcelain wire open drains hot flame lamp salt water acid base vessel jar bottle cup flask dish rod tongs pipette "
    "rack rinse small large big silver nitrate sodium potassium chloride copper sulfate zinc trigger grip button down "
    "up pressed released menu pad stick x y z grasp release drop break spill pour stir mix heat start stop end point "
    "collision enter stay exit task stage feature perceptual interaction embodied cognition virtual reality immersion "
    "interactivity conception heart rate pulse bpm hz eeg eda marker student teacher indicator methyl"
)
PLAIN: Final = {*_WORDS.split(), *(word for name in INSTRUMENTS for word in name.split("_") if word.isalpha())}
"""Words, in small letters, that lead to no person."""

MOST_DIGITS: Final = 3
"""Digits a name may keep: ``beaker_250`` has three; a year of birth and a serial have more."""

_ELEMENT = "(?:H|He|Li|Be|B|C|N|O|F|Ne|Na|Mg|Al|Si|P|S|Cl|Ar|K|Ca|Cr|Mn|Fe|Co|Ni|Cu|Zn|Br|Sr|Ag|Sn|I|Ba|Pt|Au|Hg|Pb)"
_FORMULA = re.compile(
    rf"\d{{0,2}}(?:(?:{_ELEMENT}|[()\[\].])\d{{0,2}})+\^?\d?[+-]*(?:\((?:s|l|g|aq)\))?|[-=<>+→⇌]+|\d{{1,2}}"
)
INDICATORS: Final = frozenset(("phenolphthalein", "litmus", "methyl orange", "methyl red", "bromothymol blue"))


class Names:
    """New names for old ones, kind by kind, the same for the same.

    ``allow``: whole names, or words, that may stay beside `PLAIN`.
    """

    def __init__(self, allow: Collection[str] = ()) -> None:
        self._allow, self._words = frozenset(allow), PLAIN | {one.lower() for one in allow}
        self._new: dict[tuple[str, str], str] = {}

    def of(self, kind: str, name: str) -> str:
        """The name that stands for this one; no name stays none."""
        key = kind, name
        if name and key not in self._new:
            taken = {new for (other, _), new in self._new.items() if other == kind}
            known = [word for word in re.findall(r"[a-z]+", name.lower()) if word in self._words and len(word) > 1]
            wanted = name if self.plain(name) else "-".join(known) or f"{kind}-1"
            stem, number = wanted.removesuffix("-1"), 1
            while wanted in taken:
                number += 1
                wanted = f"{stem}-{number}"
            self._new[key] = wanted
        return self._new.get(key, "")

    def settle(self, kind: str, names: Collection[str]) -> None:
        """Fix the names of a kind, those that stay before those that could take their place."""
        for name in sorted(names, key=lambda one: not self.plain(one)):
            self.of(kind, name)

    def plain(self, name: str) -> bool:
        """Whether a name may stay."""
        fits = re.fullmatch(r"[A-Za-z0-9 _./-]*", name) is not None
        spelt = re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower()
        digits = sum(one.isdigit() for one in name)
        words = re.findall(r"[a-z]+", spelt)
        return name in self._allow or (fits and digits <= MOST_DIGITS and self._words.issuperset(words))

    def changed(self) -> dict[str, int]:
        """Kind -> how many of its names are new."""
        return dict(Counter(kind for (kind, old), new in self._new.items() if old != new))


def plain_scene(scene: Scene, names: Names, moved: Callable[[Pose], Pose]) -> tuple[Scene, tuple[int, ...]]:
    """A scene with the new names and places, without paths and words of its author.

    ``moved`` gives the new pose of what is fixed in the world. The second value numbers, from 1, the effects that are
    left out because they hold words that may not stay.
    """
    names.settle("tag", [tag for body in scene.bodies for tag in body.tags])
    effects, lost = list[SceneEffect](), list[int]()
    for number, effect in enumerate(scene.effects or (), 1):
        fields = load_effect(effect.kind).fields
        words = {word for field in fields.values() for word in field.among}
        try:
            kept = {key: _said(value, scene, names, words) for key, value in effect.settings.items()}
        except _OwnWordError:
            lost.append(number)
        else:
            effects.append(SceneEffect(effect.kind, kept))

    def renamed(pairs: tuple[tuple[str, str], ...]) -> tuple[tuple[str, str], ...]:
        return tuple((names.of("body", a), names.of("body", b)) for a, b in pairs)

    made = Scene(
        bodies=tuple(_body(one, scene, names, moved) for one in scene.bodies),
        pairs=None if scene.pairs is None else renamed(scene.pairs), ignore=renamed(scene.ignore),
        effects=None if scene.effects is None else tuple(effects), space_radius=scene.space_radius,
    )  # fmt: skip
    return made, tuple(lost)


def _body(body: SceneBody, scene: Scene, names: Names, moved: Callable[[Pose], Pose]) -> SceneBody:
    extra = {}
    for key, value in body.extra.items():
        try:
            extra[key] = _said(value, scene, names, set(), keys=False)
        except _OwnWordError:
            continue
    fixed = body.fixed if body.parent or body.fixed is None else moved(body.fixed)
    tags = tuple(names.of("tag", tag) for tag in body.tags)
    return replace(
        body, id=names.of("body", body.id), mesh="", node="", scale=1.0, group=names.of("group", body.group), tags=tags,
        parent=names.of("body", body.parent), fixed=fixed, extra=extra,
    )  # fmt: skip


class _OwnWordError(Exception):
    """A text that may not stay."""


def _said(value: Any, scene: Scene, names: Names, words: Collection[str], *, keys: bool = True) -> Any:
    """A value of a scene with the new names; ``keys``: whether keys of tables are the author's, too."""
    if isinstance(value, str):
        if scene.body(value) is not None:
            return names.of("body", value)
        if value.startswith("tag:"):
            return f"tag:{names.of('tag', value[4:])}"
        known = value in words or value in COLOURS or value in INDICATORS or names.plain(value)
        if known or all(_FORMULA.fullmatch(token) for token in value.split()):
            return value
        raise _OwnWordError
    if isinstance(value, dict):
        own = {key: _said(key, scene, names, words) if keys else key for key in value}
        return {own[key]: _said(one, scene, names, words, keys=keys) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_said(one, scene, names, words, keys=keys) for one in value]
    return value
