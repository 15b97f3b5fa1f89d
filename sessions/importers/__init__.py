"""Recordings of other programs, one importer per format; conversions and dropped rows are recorded in the metadata."""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from sessions.importers.importing import import_session, importer_names, makes_bodies

__all__ = ["AUTO", "ENTRY_POINT_GROUP", "FOLDERS", "IMPORTERS", "import_session", "importer_names", "makes_bodies"]

IMPORTERS: Final[dict[str, str]] = {
    "aframe": "sessions.importers.aframe:read_aframe",
    "csv": "sessions.importers.csv_file:read_csv",
    "hands": "sessions.importers.hands.hand_csv:read_hands",
    "mcap": "sessions.importers.mcap_file:read_mcap",
    "mjcf": "sessions.importers.mjcf_motion:read_mjcf",
    "optitrack": "sessions.importers.optitrack:read_optitrack",
    "ros2": "sessions.importers.mcap_file:read_mcap",
    "usd": "sessions.importers.usd_motion:read_usd",
    "uxf": "sessions.importers.uxf:read_uxf",
    "xdf": "sessions.importers.xdf:read_xdf",
}
"""Format -> ``module:function`` that reads a path as a ``Session``; those of other packages are entry points."""

AUTO: Final = "auto"
"""The format that looks at the source first; why it took it for what it did is the fact ``taken_for``."""

FOLDERS: Final = ("uxf", AUTO)
"""Formats whose source may be a folder."""

ENTRY_POINT_GROUP: Final = "vrlab_replay.importers"


def __getattr__(name: str) -> Any:
    """Loads what reads recordings on first use, since the table of formats alone costs nothing."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(import_module("sessions.importers.importing"), name)
