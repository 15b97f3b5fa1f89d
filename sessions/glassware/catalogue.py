"""Every instrument of the bench by name: `make_instrument("beaker_250", faces=5000)` is a closed mesh of that size."""

import importlib
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any

from sessions.errors import SessionError
from sessions.glassware.instrument import Instrument

LEAST_FACES, MOST_FACES = 500, 50_000


_MODULES = {
    "burette": "burette burette_stopcock",
    "devices": "hand_left hand_right proxy_wand proxy_headset",
    "furniture": "tripod",
    "tools": "delivery_tube gas_jar_cover rubber_stopper stirring_rod tongs",
    "vessels": "dropper erlenmeyer_flask evaporating_dish watch_glass",
}
_TURNED = (
    "test_tube graduated_cylinder funnel pipette volumetric_flask reagent_bottle reagent_bottle_stopper gas_jar "
    "alcohol_lamp wick_holder"
)
_UNITED = "bench stand test_tube_rack wire_gauze"
INSTRUMENTS: Mapping[str, tuple[str, str, dict[str, Any]]] = MappingProxyType(
    {f"beaker_{size}": ("vessels", "beaker", {"millilitres": size}) for size in (50, 100, 250, 400, 600)}
    | {name: ("vessels", "from_row", {"name": name}) for name in _TURNED.split()}
    | {name: ("furniture", "from_parts", {"name": name}) for name in _UNITED.split()}
    | {name: (module, name, {}) for module, names in _MODULES.items() for name in names.split()}
)
"""Name -> module of this package, imported on use, function in it, and the options that make it this instrument."""


class UnknownInstrumentError(SessionError):
    """An instrument that is not in the table, or one asked for with options or faces it does not have."""


def make_instrument(name: str, faces: int = 5000, **options: Any) -> Instrument:
    """Return the instrument ``name`` with about ``faces`` faces; the same call gives the same mesh.

    The count is met within 25 %, within 50 % where solids are united; a part (stopcock, stopper ...) has a mesh of
    about ``faces`` faces of its own.

    Parameters
    ----------
    name : a row of `INSTRUMENTS`.
    faces : 500 to 50,000.
    **options : what the instrument's function takes, for example ``grip_radius=0.02`` for a hand.

    Raises ``UnknownInstrumentError``: when there is no such instrument or option, or ``faces`` is out of range.

    Examples
    --------
    >>> make_instrument("beaker_250", faces=500).cavity.capacity_m3
    0.00025
    """
    if name not in INSTRUMENTS:
        raise UnknownInstrumentError(f"no instrument {name!r}; there are: {', '.join(INSTRUMENTS)}")
    if not LEAST_FACES <= faces <= MOST_FACES:
        raise UnknownInstrumentError(f"{name} with {faces} faces; ask for {LEAST_FACES} to {MOST_FACES:,}")
    make, allowed = _maker(name), instrument_options(name)
    unknown = set(options) - allowed
    if unknown:
        known = ", ".join(sorted(allowed)) or "none"
        raise UnknownInstrumentError(f"{name} has no option {', '.join(sorted(unknown))}; its options: {known}")
    return make(faces, **INSTRUMENTS[name][2], **options)


@lru_cache(maxsize=192)
def made_instrument(name: str, faces: int, options: tuple[tuple[str, Any], ...] = ()) -> Instrument:
    """An instrument, made once: hands take most of a second, instruments never change, and all scenes need 60."""
    return make_instrument(name, faces, **dict(options))


def instrument_options(name: str) -> set[str]:
    """The options that an instrument of the table takes."""
    return set(_maker(name).__kwdefaults__ or ()) - set(INSTRUMENTS[name][2])


def _maker(name: str) -> Any:
    module, function, _ = INSTRUMENTS[name]
    return getattr(importlib.import_module(f"sessions.glassware.{module}"), function)
