"""The table of effects: a kind leads to its file, which is imported when a plan holds the kind and never otherwise.

Adding an effect is one file that defines a ``SPEC`` (see ``replay.effects.protocol``, which says how) and one table in
``catalogue.toml``. A row from outside is an entry point of the group below, ``kind = "package.module:SPEC"``.
"""

import sys
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module, resources
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from replay.errors import EffectError

if TYPE_CHECKING:
    from replay.effects.protocol import EffectSpec

CATALOGUE: Final[dict[str, dict[str, Any]]] = tomllib.loads(
    resources.files(__package__).joinpath("catalogue.toml").read_text(encoding="utf-8")
)
"""Kind -> all that is declared of an effect; the kinds are the words of ``kind = `` in a scene."""

RETIRED_KINDS: Final[Mapping[str, str]] = CATALOGUE.pop("retired")
"""Kind that older scenes declare -> what to write instead."""

EFFECTS: Final[dict[str, str]] = {kind: f"replay.effects.{kind.replace('-', '_')}:SPEC" for kind in CATALOGUE}
"""Kind -> ``module:SPEC``."""

ENTRY_POINT_GROUP: Final = "vrlab_replay.effects"


def effect_kinds() -> tuple[str, ...]:
    """Every kind a scene may declare: the table's first, those of installed packages after them."""
    return (*EFFECTS, *(name for name in sorted(_installed_entries(tuple(sys.path))) if name not in EFFECTS))


@lru_cache(maxsize=4)
def _installed_entries(path: tuple[str, ...]) -> Mapping[str, str]:
    """Kind -> entry of installed packages, read once for a search path: reading takes 8 ms, nine tenths of a plan."""
    del path  # the key alone; `entry_points` looks along ``sys.path`` itself
    return MappingProxyType({point.name: point.value for point in reversed([*entry_points(group=ENTRY_POINT_GROUP)])})


def load_effect(kind: str) -> "EffectSpec":
    """The spec of a kind; this imports the effect's file.

    Raises EffectError: there is no such kind, or its file cannot be loaded.
    """
    entry = EFFECTS.get(kind) or _installed_entries(tuple(sys.path)).get(kind)
    if entry is None:
        raise EffectError(f"no effect {kind!r}; there are: {', '.join(effect_kinds())}")
    module, _, attribute = entry.partition(":")
    try:
        spec: EffectSpec = getattr(import_module(module), attribute or "SPEC")
    except Exception as error:  # another package's module may fail with anything
        where = f"effect {kind!r} ({entry})"
        raise EffectError(f"{where} cannot be loaded: {error}; repair or remove its package") from error
    if spec.kind != kind:
        raise EffectError(f"{entry} calls itself {spec.kind!r} and its row {kind!r}; give both one name")
    return spec
