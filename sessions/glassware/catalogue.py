"""Every instrument of the bench by name: `make_instrument("beaker_250", faces=5000)` is a closed mesh of that size."""

import importlib
from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Any

from sessions.errors import SessionError
from sessions.glassware.instrument import Instrument

LEAST_FACES, MOST_FACES = 500, 50_000


_MODULES = {
    "vessels": (
        "beaker_50 beaker_100 beaker_250 beaker_400 beaker_600 test_tube graduated_cylinder funnel pipette "
        "volumetric_flask reagent_bottle reagent_bottle_stopper gas_jar alcohol_lamp wick_holder dropper "
        "erlenmeyer_flask evaporating_dish watch_glass stirring_rod"
    ),
    "united": "bench stand test_tube_rack wire_gauze tripod tongs rubber_stopper burette_stopcock",
    "glass": "burette delivery_tube gas_jar_cover",
    "devices": "hand_left hand_right proxy_wand proxy_headset",
}
INSTRUMENTS: Mapping[str, str] = {name: module for module, names in _MODULES.items() for name in names.split()}
"""Name -> module of this package, imported on use."""


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
    allowed = instrument_options(name)
    unknown = set(options) - allowed
    if unknown:
        known = ", ".join(sorted(allowed)) or "none"
        raise UnknownInstrumentError(f"{name} has no option {', '.join(sorted(unknown))}; its options: {known}")
    return _maker(name)(faces, **options)


@lru_cache(maxsize=192)
def made_instrument(name: str, faces: int, options: tuple[tuple[str, Any], ...] = ()) -> Instrument:
    """An instrument, made once: hands take most of a second, instruments never change, and all scenes need 60."""
    return make_instrument(name, faces, **dict(options))


def instrument_options(name: str) -> set[str]:
    """The options that an instrument of the table takes."""
    return set(getattr(_maker(name), "__kwdefaults__", None) or ())


def _maker(name: str) -> Any:
    """The function of the instrument's module that bears its name, or the one that reads its row."""
    module = importlib.import_module(f"sessions.glassware.{INSTRUMENTS[name]}")
    return getattr(module, name, None) or partial(module.from_row, name=name)
