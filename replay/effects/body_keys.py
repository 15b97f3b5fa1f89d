"""What a scene may say of a body for effects: the keys of ``cavity`` and ``properties``, at every depth."""

from collections.abc import Mapping
from typing import Any, Final

from sessions.errors import SessionError
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import TomlTable

BODY_KEYS: Final[Mapping[str, Any]] = {
    "cavity": dict.fromkeys(
        ("shape", "capacity_ml", "floor", "mark", "radius", "height", "opening_radius", "opening", "lip"), ""
    ),
    "properties": {
        "liquid": dict.fromkeys(("volume_ml", "solute", "molar", "water_molar", "solutes"), ""),
        "solid": dict.fromkeys(("formula", "mass_g", "molar_mass", "density_g_ml"), ""),
        "heat_capacity_j_per_k": "",
    },
}  # fmt: skip
"""Key -> the keys of the table it is, or ``""`` where it is none. Nothing else is read by any effect."""


def body_faults(scene: Scene, file: str, more: Mapping[str, Any]) -> list[str]:
    """Every unknown key of a body's tables; file, table, key and the nearest known name.

    ``more``: further keys of ``properties``.
    """
    faults: list[str] = []
    known = {**BODY_KEYS, "properties": {**BODY_KEYS["properties"], **more}}
    for row, body in enumerate(scene.bodies, start=1):
        held = {key: value for key, value in body.extra.items() if key in known}
        _look(TomlTable(held, file, f"[[body]] {row} ({body.id!r})", SessionError, faults), known)
    return faults


def _look(table: TomlTable, known: Mapping[str, Any]) -> None:
    for key, keys in known.items():
        inner = table.table(key) if keys else None
        if inner is not None:
            _look(inner, keys)
    table.done(known)
