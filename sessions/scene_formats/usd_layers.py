"""Opens a USD stage of which every layer lies in the scene's folder, and which composes no more than memory holds.

The library follows sublayers, references and payloads wherever they lead, and copies what they name any number of
times; both are asked of the layers before it composes them. The only module of `sessions` that imports pxr.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from sessions.errors import SceneSourceError
from sessions.input_files import kind_of_file
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.usd_trial import try_scene

ENDINGS: Final = (".usd", ".usda", ".usdc", ".usdz")
ADDRESS: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")
"""Begins the name of a layer that is no file; a drive of Windows has one letter."""
TEXT: Final = b"#usda"
"""Begins a layer in text."""
EXPRESSION: Final = "`"
CLIPS: Final = "clips"
ARCS: Final = ("references", "payload", "inheritPaths", "specializes", "variantSetNames")
"""Fields of a prim by which others become parts of it."""
MOST_PRIMS: Final = 100_000
"""Of a composed scene; a few lines that refer to each other may ask for any number."""
LONGEST_REASON: Final = 200


def usd_of() -> Any:
    """The modules of the library by name; SceneSourceError where it is not installed."""
    try:
        from pxr import Ar, Gf, Pcp, Sdf, Usd, UsdGeom, UsdPhysics, UsdUtils
    except ImportError as error:
        raise SceneSourceError('USD needs usd-core; install it: pip install "vrlab-replay[usd]"') from error
    return SimpleNamespace(
        Ar=Ar, Gf=Gf, Pcp=Pcp, Sdf=Sdf, Usd=Usd, UsdGeom=UsdGeom, UsdPhysics=UsdPhysics, UsdUtils=UsdUtils
    )


@contextmanager
def usd_errors(path: Path) -> Iterator[Any]:
    """The library's modules; what it prints is dropped, and what it raises becomes a ``SceneSourceError``."""
    usd = usd_of()
    diagnostics = usd.UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield usd
    except SceneSourceError as error:
        raise SceneSourceError(str(error) if str(path) in str(error) else f"{path}: {error}") from error
    except Exception as error:  # of another package: any error means that it cannot be read
        raise SceneSourceError(f"usd-core does not read {path}: {_reason(error)}; correct it") from error
    finally:
        diagnostics.TakeUncoalescedDiagnostics()


def open_stage(usd: Any, path: Path, files: SceneFiles, *, is_trial: bool = False) -> tuple[Any, list[str]]:
    """The composed stage, and sentences on layers and parts that are missing.

    ``is_trial``: this process may die of a damaged binary layer; else another one tries the scene first.

    Raises ``SceneSourceError``: a layer outside the folder, by an address or of another type; parts that contain
    themselves; more prims than are taken.
    """
    layers = _Layers(usd, files, is_tried=is_trial)
    root = layers.checked(path)
    if layers.composes:
        _check_amount(usd, root, path)
    stage = usd.Usd.Stage.Open(root)
    for error in stage.GetCompositionErrors():
        if isinstance(error, usd.Pcp.ErrorArcCycle | usd.Pcp.ErrorSublayerCycle):
            raise SceneSourceError(f"{path} has a part or layer that contains itself; take the circle out")
        if not isinstance(error, usd.Pcp.ErrorInvalidAssetPath | usd.Pcp.ErrorInvalidSublayerPath):
            layers.missing.append(f"a part that cannot be composed: {_reason(error)}")
    return stage, layers.missing


@dataclass
class _Layers:
    """Opens every layer that a scene may compose, in any variant, after asking where it lies."""

    usd: Any
    files: SceneFiles
    missing: list[str] = field(default_factory=list)
    composes: bool = False
    is_tried: bool = False
    _path: Path = Path()
    _opened: dict[str, Any] = field(default_factory=dict)

    def checked(self, path: Path) -> Any:
        """The root layer, once all layers that it leads to are checked; they stay open as long as this lives."""
        self.files.inside(path, f"the scene {path.name!r}")
        self._path = path
        root = self._layer(str(path), f"the scene {path.name!r}")
        waiting = [root]
        while waiting:
            layer = waiting.pop()
            # A part of the same layer has no name.
            for name in filter(None, layer.GetCompositionAssetDependencies()):
                dependency = self._dependency(layer, name)
                if dependency is not None:
                    waiting.append(dependency)
        return root

    def _dependency(self, layer: Any, name: str) -> Any:
        """The layer that another names; ``None``: it is open already, or missing."""
        if name.startswith(EXPRESSION):
            raise SceneSourceError(
                f"{layer.GetDisplayName()} names a layer by an expression, {name[:60]}; write it out"
            )
        if ADDRESS.match(name):
            raise SceneSourceError(
                f"{layer.GetDisplayName()} names a layer by an address, {name[:60]!r}; put the file beside it"
            )
        bare, _ = self.usd.Sdf.Layer.SplitIdentifier(name)
        identifier = self.usd.Sdf.ComputeAssetPathRelativeToLayer(layer, bare)
        if identifier in self._opened:
            return None
        # A bare name is looked for beside the layer, then in the working folder and in those of a variable.
        resolved = str(self.usd.Ar.GetResolver().Resolve(identifier)) or identifier
        outer = Path(self.usd.Ar.SplitPackageRelativePathOuter(resolved)[0])
        if not outer.is_absolute() or (self.files.is_within(outer) and not self.files.exists(outer)):
            self.missing.append(f"the layer {name!r}, which is missing")
            return None
        self.files.inside(outer, f"the layer {name!r}")
        return self._layer(identifier, f"the layer {name!r}")

    def _layer(self, identifier: str, named: str) -> Any:
        """Open a layer that lies in the folder, and look at its prims."""
        outer, inner = self.usd.Ar.SplitPackageRelativePathOuter(identifier)
        if Path(inner or outer).suffix.lower() not in ENDINGS:
            raise SceneSourceError(f"{named} is no USD file; a scene refers to {', '.join(ENDINGS)}")
        if not self.is_tried and not _is_text(Path(outer)):
            self.is_tried = True
            try_scene(self._path, self.files.root)
        try:
            layer = self.usd.Sdf.Layer.FindOrOpen(identifier)
        except Exception as error:  # of another package: any error means that it cannot be read
            kind = kind_of_file(outer)
            reason = f"but {kind}" if kind else f"({_reason(error)}); export it again"
            raise SceneSourceError(f"{named} is no readable USD {reason}") from error
        if layer is None:
            raise SceneSourceError(f"{named} is no readable USD; export it again")
        self._opened[identifier] = layer
        layer.Traverse("/", lambda path: self._visit(layer, path))
        return layer

    def _visit(self, layer: Any, path: Any) -> None:
        if not (path.IsPrimPath() or path.IsPrimVariantSelectionPath()):
            return
        prim = layer.GetObjectAtPath(path)
        if prim.HasInfo(CLIPS):
            raise SceneSourceError(f"{path} takes its values from value clips, which are not taken; flatten the scene")
        self.composes = self.composes or any(prim.HasInfo(name) for name in ARCS)


def _is_text(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(TEXT)) == TEXT


def _check_amount(usd: Any, root: Any, path: Path) -> None:
    """Compose one prim after another, up to as many as are taken."""
    cache = usd.Pcp.Cache(usd.Pcp.LayerStackIdentifier(root), usd=True)
    waiting, count = [usd.Sdf.Path.absoluteRootPath], 0
    while waiting:
        prim = waiting.pop()
        index, errors = cache.ComputePrimIndex(prim)
        if any(isinstance(error, usd.Pcp.ErrorArcCycle) for error in errors):
            raise SceneSourceError(f"{path} has a part that contains itself, {prim}; take the circle out")
        names, _ = index.ComputePrimChildNames()
        children = [prim.AppendChild(name) for name in names]
        # A stage loads every payload, a cache those alone that it is asked for.
        cache.RequestPayloads(children, [])
        waiting += children
        count += len(names)
        if count > MOST_PRIMS:
            raise SceneSourceError(f"{path} composes more than {MOST_PRIMS:,} prims; leave out what does not matter")


def _reason(error: object) -> str:
    """The library's own words on an error, on one line; it may quote the bytes of a file."""
    text = "".join(letter if letter.isprintable() else "?" for letter in " ".join(str(error).split()))
    return text if len(text) <= LONGEST_REASON else f"{text[:LONGEST_REASON]} ..."
