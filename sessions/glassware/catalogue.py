"""Every instrument of the bench by name: `make_instrument("beaker_250", faces=5000)` is a closed mesh of that size."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from sessions.errors import SessionError
from sessions.glassware.instrument import Instrument

LEAST_FACES, MOST_FACES = 500, 50_000


@dataclass(frozen=True)
class InstrumentSpec:
    """Where an instrument is made (``module:function``, imported on use) and the options that make it this one."""

    entry: str
    options: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


def _beaker(millilitres: int) -> InstrumentSpec:
    return InstrumentSpec("sessions.glassware.beakers:beaker", MappingProxyType({"millilitres": millilitres}))


INSTRUMENTS: Mapping[str, InstrumentSpec] = MappingProxyType(
    {
        "beaker_50": _beaker(50),
        "beaker_100": _beaker(100),
        "beaker_250": _beaker(250),
        "beaker_400": _beaker(400),
        "beaker_600": _beaker(600),
        "erlenmeyer_flask": InstrumentSpec("sessions.glassware.flasks:erlenmeyer_flask"),
        "volumetric_flask": InstrumentSpec("sessions.glassware.flasks:volumetric_flask"),
        "reagent_bottle": InstrumentSpec("sessions.glassware.flasks:reagent_bottle"),
        "reagent_bottle_stopper": InstrumentSpec("sessions.glassware.flasks:reagent_bottle_stopper"),
        "test_tube": InstrumentSpec("sessions.glassware.tubes:test_tube"),
        "test_tube_rack": InstrumentSpec("sessions.glassware.furniture:test_tube_rack"),
        "graduated_cylinder": InstrumentSpec("sessions.glassware.tubes:graduated_cylinder"),
        "funnel": InstrumentSpec("sessions.glassware.tubes:funnel"),
        "burette": InstrumentSpec("sessions.glassware.burette:burette"),
        "burette_stopcock": InstrumentSpec("sessions.glassware.burette:burette_stopcock"),
        "pipette": InstrumentSpec("sessions.glassware.tubes:pipette"),
        "dropper": InstrumentSpec("sessions.glassware.tubes:dropper"),
        "watch_glass": InstrumentSpec("sessions.glassware.dishes:watch_glass"),
        "evaporating_dish": InstrumentSpec("sessions.glassware.dishes:evaporating_dish"),
        "gas_jar": InstrumentSpec("sessions.glassware.beakers:gas_jar"),
        "gas_jar_cover": InstrumentSpec("sessions.glassware.beakers:gas_jar_cover"),
        "delivery_tube": InstrumentSpec("sessions.glassware.tools:delivery_tube"),
        "rubber_stopper": InstrumentSpec("sessions.glassware.tools:rubber_stopper"),
        "stirring_rod": InstrumentSpec("sessions.glassware.tools:stirring_rod"),
        "tongs": InstrumentSpec("sessions.glassware.tools:tongs"),
        "alcohol_lamp": InstrumentSpec("sessions.glassware.tools:alcohol_lamp"),
        "wick_holder": InstrumentSpec("sessions.glassware.tools:wick_holder"),
        "stand": InstrumentSpec("sessions.glassware.furniture:stand"),
        "tripod": InstrumentSpec("sessions.glassware.furniture:tripod"),
        "wire_gauze": InstrumentSpec("sessions.glassware.furniture:wire_gauze"),
        "bench": InstrumentSpec("sessions.glassware.furniture:bench"),
        "hand_left": InstrumentSpec("sessions.glassware.hands:hand_left"),
        "hand_right": InstrumentSpec("sessions.glassware.hands:hand_right"),
        "proxy_wand": InstrumentSpec("sessions.glassware.proxies:proxy_wand"),
        "proxy_headset": InstrumentSpec("sessions.glassware.proxies:proxy_headset"),
    }
)


class UnknownInstrumentError(SessionError):
    """An instrument that is not in the table, or one asked for with options or faces it does not have."""


def make_instrument(name: str, faces: int = 5000, **options: Any) -> Instrument:
    """Return the instrument ``name`` with about ``faces`` faces; the same call gives the same mesh.

    The count is met within 25 %, within 50 % where parts are united by booleans; parts (stopcock, stopper ...) have
    meshes of about ``faces`` faces of their own.

    Parameters
    ----------
    name
        A row of `INSTRUMENTS`.
    faces
        500 to 50,000.
    **options
        What the instrument's function takes, for example ``grip_radius=0.02`` for a hand.

    Raises
    ------
    UnknownInstrumentError
        When there is no such instrument or option, or ``faces`` is out of range.

    Examples
    --------
    >>> make_instrument("beaker_250", faces=500).cavity.capacity_m3
    0.00025
    """
    if name not in INSTRUMENTS:
        raise UnknownInstrumentError(f"no instrument {name!r}; there are: {', '.join(INSTRUMENTS)}")
    if not LEAST_FACES <= faces <= MOST_FACES:
        raise UnknownInstrumentError(f"{name} with {faces} faces; ask for {LEAST_FACES} to {MOST_FACES:,}")
    spec = INSTRUMENTS[name]
    module, function = spec.entry.split(":")
    make = getattr(importlib.import_module(module), function)
    allowed = set(make.__kwdefaults__ or ()) - set(spec.options)
    unknown = set(options) - allowed
    if unknown:
        known = ", ".join(sorted(allowed)) or "none"
        raise UnknownInstrumentError(f"{name} has no option {', '.join(sorted(unknown))}; its options: {known}")
    instrument: Instrument = make(faces, **spec.options, **options)
    return instrument
