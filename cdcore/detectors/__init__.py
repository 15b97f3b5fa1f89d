"""The table of detectors: a name leads to a class, imported when it is used and not before."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any, Final

from numpy.typing import ArrayLike

from cdcore.errors import InvalidPairError, InvalidSettingError, UnknownDetectorError
from cdcore.protocol import Body, Detector, resolve_pairs
from cdcore.protocol.settings import check_settings

DETECTORS: Final[dict[str, str]] = {
    "sphere": "cdcore.detectors.sphere:SphereDetector",
    "aabb": "cdcore.detectors.trees:AabbDetector",
    "obb": "cdcore.detectors.trees:ObbDetector",
    "static": "cdcore.detectors.meshes:StaticDetector",
    "discrete": "cdcore.detectors.meshes:DiscreteDetector",
    "hybrid": "cdcore.detectors.meshes:HybridDetector",
    "qaco": "cdcore.detectors.qaco:QacoDetector",
    "hybrid-qaco": "cdcore.detectors.qaco:HybridQacoDetector",
    "collider": "cdcore.detectors.collider:ColliderDetector",
    "rapid-style": "cdcore.detectors.trees:RapidStyleDetector",
    "solid-style": "cdcore.detectors.trees:SolidStyleDetector",
    "image-space": "cdcore.detectors.image_space:ImageSpaceDetector",
    "exact": "cdcore.detectors.exact:ExactDetector",
    "continuous": "cdcore.detectors.continuous:ContinuousDetector",
}
"""Name -> ``module:Class``. Rows from outside come in through the entry-point group below."""

OPTIONAL: Final[dict[str, str]] = {
    "mujoco": "cdcore.detectors.engines:MujocoDetector",
    "rapier": "cdcore.detectors.engines:RapierDetector",
    "bullet": "cdcore.detectors.engines:BulletDetector",
    "physx": "cdcore.detectors.engines:PhysxDetector",
}
"""Rows that need an engine of an extra; without it they are refused when they are made."""

ENTRY_POINT_GROUP: Final = "vrlab_replay.detectors"

PAPER: Final = (
    "Design of Virtual Experiment Teaching of Inorganic Chemistry in Colleges and Universities Based on Unity3D"
)
COLONY: Final = (
    "P. Li, S. Li, Quantum ant colony algorithm for continuous space optimization, Control Theory & Applications "
    "25(2), 2008",
    "P. Li, K. Song, E. Yang, ICNC 2010, on the quantum ant colony, 10.1109/ICNC.2010.5583935",
)
FCL: Final = (
    "J. Pan, S. Chitta, D. Manocha, FCL: a general purpose library for collision and proximity queries, ICRA 2012"
)
OBB_TREE: Final = (
    "S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection, "
    "SIGGRAPH 1996"
)
"""Sources that several detectors name; ``COLONY`` are two."""


def detector_names() -> list[str]:
    """Every name that ``create_detector`` takes, the table's first, those of installed packages after them."""
    outside = sorted(point.name for point in entry_points(group=ENTRY_POINT_GROUP))
    rows = list(DETECTORS | OPTIONAL)
    return rows + [name for name in outside if name not in rows]


def load_detector(name: str) -> type[Any]:
    """The class behind a name, or behind ``module:Class``; UnknownDetectorError with the names there are."""
    rows = DETECTORS | OPTIONAL
    entry = name if ":" in name else rows.get(name)
    if entry is None:  # reading what is installed takes longer than most detectors take to be made
        entry = next((point.value for point in entry_points(group=ENTRY_POINT_GROUP, name=name)), None)
    if entry is None:
        near = get_close_matches(name, detector_names(), n=1)
        hint = f"did you mean {near[0]!r}? There" if near else "there"
        raise UnknownDetectorError(f"no detector {name!r}; {hint} are: {', '.join(detector_names())}")
    if name in rows:
        module, _, attribute = entry.partition(":")
        return _checked(name, getattr(import_module(module), attribute))
    try:
        return _checked(name, _load_class(*entry.split(":", maxsplit=1)))
    except LookupError as error:
        if name == entry:
            raise UnknownDetectorError(str(error.args[0])) from error
        text = f"detector {name!r} ({entry}) cannot be loaded: {error.args[0]}; repair or remove its package"
        raise UnknownDetectorError(text) from error


def _load_class(module_name: str, class_name: str) -> Any:
    """A class of a module from outside; LookupError says what of it is missing, or why the module fails."""
    try:
        module = import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is not None and f"{module_name}.".startswith(f"{error.name}."):
            raise LookupError(f"there is no module {error.name!r} in this folder or this environment") from error
        raise LookupError(f"{module_name} cannot be imported: {error}") from error
    except Exception as error:  # a module from outside may fail with anything
        raise LookupError(f"{module_name} cannot be imported: {type(error).__name__}: {error}") from error
    if hasattr(module, class_name):
        return getattr(module, class_name)
    own = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == module_name]
    near = get_close_matches(class_name, own, n=1)
    hint = f"did you mean {module_name}:{near[0]}?" if near else f"it defines: {', '.join(own) or 'nothing'}"
    raise LookupError(f"{module_name} has no class {class_name!r}; {hint}")


def _checked(name: str, found: type[Any]) -> type[Any]:
    lacks = [part for part in ("Settings", "detect", "stream") if not hasattr(found, part)]
    lacks += sorted(getattr(found, "__abstractmethods__", ()))
    if lacks:
        text = f"{name!r} is no detector: it defines no {', '.join(lacks)}; see cdcore.FrameDetector"
        raise UnknownDetectorError(text)
    return found


def create_detector(
    name: str, bodies: Sequence[Body], *, pairs: ArrayLike | None = None, **settings: object
) -> Detector:
    """Make a detector ready to run: its trees are built here, not in ``detect``.

    Parameters
    ----------
    name : a row of ``DETECTORS``, an entry point, or ``module:Class``.
    bodies : the bodies of the scene, names all different.
    pairs : (P, 2) body numbers or names; ``None``: all i < j.
    settings : fields of the detector's ``Settings``.

    Raises
    ------
    UnknownDetectorError, InvalidSettingError, InvalidPairError, MissingEngineError
    """
    detector = load_detector(name)
    if not bodies:
        raise InvalidPairError("there are no bodies; a detector needs at least one")
    return detector(bodies, resolve_pairs(bodies, pairs), settings_of(name, settings))


def settings_of(name: str, settings: Mapping[str, object]) -> Any:
    """The settings of a detector, checked; raises as ``create_detector`` does."""
    detector = load_detector(name)
    known = [item.name for item in fields(detector.Settings)]
    unknown = [key for key in settings if key not in known]
    if unknown:
        has = f"it has: {', '.join(known)}" if known else "it has none"
        raise InvalidSettingError(f"detector {name!r} has no setting {unknown[0]!r}; {has}")
    chosen = detector.Settings(**settings)
    check_settings(chosen)
    return chosen
