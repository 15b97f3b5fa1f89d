"""A scene as TOML, so that a made-up session carries its scene the way an author would have written it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from sessions.scene import Pose, Scene, SceneBody


def with_text(scene: Scene, remarks: Sequence[str] = ()) -> Scene:
    """Return the scene with its own TOML in ``text``, headed by remarks."""
    return replace(scene, text=scene_text(scene, remarks))


def scene_text(scene: Scene, remarks: Sequence[str] = ()) -> str:
    """Return the scene as TOML: remarks, name, ``[[body]]``, ``[[pair]]``, ``[[ignore]]``, ``[[effect]]``."""
    blocks = ["\n".join([*(f"# {line}" for line in remarks), f"name = {_value(scene.name)}"])]
    blocks += [_table("body", _body(body)) for body in scene.bodies]
    blocks += [_table("pair", {"between": list(pair)}) for pair in scene.pairs or ()]
    blocks += [_table("ignore", {"between": list(pair)}) for pair in scene.ignore]
    blocks += [_table("effect", {"kind": effect.kind, **effect.settings}) for effect in scene.effects or ()]
    if scene.effects == ():
        blocks[0] += "\neffect = []"
    return "\n\n".join(blocks) + "\n"


def _body(body: SceneBody) -> dict[str, Any]:
    """What of a body differs from saying nothing."""
    plain = SceneBody(body.id)
    table: dict[str, Any] = {"id": body.id}
    for key in ("mesh", "shape", "instrument", "size", "scale", "group", "parent", "tags", "proxy"):
        if getattr(body, key) != getattr(plain, key):
            table[key] = getattr(body, key)
    for key in ("offset", "fixed"):
        pose = getattr(body, key)
        if pose is not None and pose != Pose():
            table[key] = {"position": list(pose.position), "quaternion_xyzw": list(pose.quaternion_xyzw)}
    if body.fixed == Pose():
        table["fixed"] = {"position": [0.0, 0.0, 0.0]}
    return {**table, **body.extra}


def _table(name: str, values: Mapping[str, Any]) -> str:
    return "\n".join([f"[[{name}]]", *(f"{_key(key)} = {_value(value)}" for key, value in values.items())])


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return f"{{ {inner} }}"
    return "[" + ", ".join(_value(item) for item in value) + "]"


def _key(key: str) -> str:
    bare = all(letter.isascii() and (letter.isalnum() or letter in "-_") for letter in key)
    return key if key and bare else json.dumps(key)
