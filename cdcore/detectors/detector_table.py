"""The table of detectors: a name leads to a class, imported when it is used and not before."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any, Final

from numpy.typing import ArrayLike

from cdcore.errors import InvalidPairError, InvalidSettingError, UnknownDetectorError
from cdcore.protocol import Body, Detector, resolve_pairs
from cdcore.protocol.settings import check_settings


@dataclass(frozen=True, kw_only=True)
class DetectorRow:
    """A detector of the table.

    Parameters
    ----------
    entry : ``module:Class``, imported when it is used and not before.
    label : noun phrase for what it tests, as a sentence and a legend say it.
    is_singular : whether ``label`` is singular, as in "the search is", not "the meshes are".
    sampled : whether engines run it at a step rate, so that running on every frame is worth a word.
    complete_with : settings with which it misses no contact at a frame; ``None``: there are none.
    contact_offset : its setting of a contact offset; ``""``: it has none.
    takes_no_offset : whether that setting may be 0.
    engine : module of the engine that it asks; ``""``: none.
    extra : extra of the package that installs this engine.
    no_triangles : why random triangles say nothing about it; ``""``: they do.
    """

    entry: str
    label: str
    is_singular: bool = False
    sampled: bool = False
    complete_with: Mapping[str, Any] | None = None
    contact_offset: str = ""
    takes_no_offset: bool = True
    engine: str = ""
    extra: str = ""
    no_triangles: str = ""


HULLS: Final = "answers about the hull, which is another solid"
ASKS_INSIDE: Final[Mapping[str, Any]] = {"containment": True}

DETECTORS: Final[dict[str, DetectorRow]] = {
    "sphere": DetectorRow(
        entry="cdcore.detectors.sphere:SphereDetector",
        label="bounding spheres",
        no_triangles="answers about bounding spheres, not about triangles",
    ),
    "aabb": DetectorRow(
        entry="cdcore.detectors.trees:AabbDetector", label="boxes, then triangles", complete_with=ASKS_INSIDE
    ),
    "obb": DetectorRow(
        entry="cdcore.detectors.trees:ObbDetector", label="turned boxes, then triangles", complete_with=ASKS_INSIDE
    ),
    "static": DetectorRow(
        entry="cdcore.detectors.meshes:StaticDetector",
        label="triangles after a move",
        complete_with=ASKS_INSIDE,
        no_triangles="tests the same meshes as discrete, and its spheres would take nine minutes",
    ),
    "discrete": DetectorRow(
        entry="cdcore.detectors.meshes:DiscreteDetector",
        label="triangle meshes",
        sampled=True,
        complete_with=ASKS_INSIDE,
    ),
    "hybrid": DetectorRow(
        entry="cdcore.detectors.meshes:HybridDetector", label="spheres, boxes, triangles", complete_with=ASKS_INSIDE
    ),
    "qaco": DetectorRow(entry="cdcore.detectors.qaco:QacoDetector", label="ant colony", is_singular=True),
    "hybrid-qaco": DetectorRow(
        entry="cdcore.detectors.qaco:HybridQacoDetector",
        label="published ant colony search",
        is_singular=True,
        complete_with={"decide": "mesh", "containment": True},
    ),
    "collider": DetectorRow(
        entry="cdcore.detectors.collider:ColliderDetector",
        label="colliders",
        sampled=True,
        complete_with={"shape": "mesh"},
        contact_offset="skin_m",
        no_triangles="answers about a solid that stands in for the mesh",
    ),
    "rapid-style": DetectorRow(
        entry="cdcore.detectors.trees:RapidStyleDetector", label="trees as in RAPID", complete_with=ASKS_INSIDE
    ),
    "solid-style": DetectorRow(
        entry="cdcore.detectors.trees:SolidStyleDetector", label="trees as in SOLID", complete_with=ASKS_INSIDE
    ),
    "image-space": DetectorRow(
        entry="cdcore.detectors.image_space:ImageSpaceDetector",
        label="depth images",
        no_triangles="refuses open meshes, and one triangle is open",
    ),
    "exact": DetectorRow(
        entry="cdcore.detectors.exact:ExactDetector",
        label="every triangle, every frame",
        is_singular=True,
        complete_with=ASKS_INSIDE,
    ),
    "continuous": DetectorRow(
        entry="cdcore.detectors.continuous:ContinuousDetector", label="every triangle, between frames", is_singular=True
    ),
}
"""Name -> row. Rows from outside come in through an entry-point group."""

OPTIONAL: Final[dict[str, DetectorRow]] = {
    "mujoco": DetectorRow(
        entry="cdcore.detectors.engines:MujocoDetector",
        label="MuJoCo's colliders",
        contact_offset="margin_m",
        engine="mujoco",
        extra="engines",
        no_triangles=HULLS,
    ),
    "rapier": DetectorRow(
        entry="cdcore.detectors.engines:RapierDetector",
        label="Rapier's colliders",
        contact_offset="prediction_m",
        engine="rapier3d",
        extra="engines",
        no_triangles=HULLS,
    ),
    "bullet": DetectorRow(
        entry="cdcore.detectors.engines:BulletDetector",
        label="Bullet's colliders",
        contact_offset="margin_m",
        engine="pybullet",
        extra="engines",
        no_triangles=HULLS,
    ),
    "physx": DetectorRow(
        entry="cdcore.detectors.engines:PhysxDetector",
        label="PhysX's colliders",
        contact_offset="contact_offset_m",
        takes_no_offset=False,
        engine="ovphysx",
        extra="physx",
        no_triangles=HULLS,
    ),
    "newton": DetectorRow(
        entry="cdcore.detectors.engines:NewtonDetector",
        label="Newton's colliders",
        contact_offset="gap_m",
        engine="newton",
        extra="newton",
        no_triangles=HULLS,
    ),
}
"""Rows that need an engine of an extra; without it they are refused when they are made."""

TABLE: Final[Mapping[str, DetectorRow]] = DETECTORS | OPTIONAL


def detector_row(name: str) -> DetectorRow:
    """Return the row of a detector; of one from outside, a row that says its name alone."""
    return TABLE.get(name) or DetectorRow(entry=name, label=name, is_singular=True)


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
    rows = list(TABLE)
    return rows + [name for name in outside if name not in rows]


def load_detector(name: str) -> type[Any]:
    """The class behind a name, or behind ``module:Class``; UnknownDetectorError with the names there are."""
    row = TABLE.get(name)
    entry = name if ":" in name else None if row is None else row.entry
    if entry is None:  # reading what is installed takes longer than most detectors take to be made
        entry = next((point.value for point in entry_points(group=ENTRY_POINT_GROUP, name=name)), None)
    if entry is None:
        known_names = detector_names()
        near = get_close_matches(name, known_names, n=1)
        hint = f"did you mean {near[0]!r}? There" if near else "there"
        raise UnknownDetectorError(f"no detector {name!r}; {hint} are: {', '.join(known_names)}")
    if row is not None:
        module, _, attribute = entry.partition(":")
        return _checked_class(name, getattr(import_module(module), attribute))
    try:
        return _checked_class(name, _load_class(*entry.split(":", maxsplit=1)))
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


def _checked_class(name: str, detector_class: type[Any]) -> type[Any]:
    lacks = [attribute for attribute in ("Settings", "detect", "stream") if not hasattr(detector_class, attribute)]
    lacks += sorted(getattr(detector_class, "__abstractmethods__", ()))
    if lacks:
        text = f"{name!r} is no detector: it defines no {', '.join(lacks)}; see cdcore.FrameDetector"
        raise UnknownDetectorError(text)
    return detector_class


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
