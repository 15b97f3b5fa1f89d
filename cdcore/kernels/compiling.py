"""How kernels are compiled: once per machine, again when any of their sources changes.

numba looks only at the file in which a kernel stands. Kernels call each other across files, so the folder in which
numba keeps machine code is named by a hash of all their sources.

Three habits of the compiler make kernels expensive to compile. It copies a function into each of its many call sites,
and makes a version of it for every literal number it is called with: without the first mark below, and with versions
for numbers (which ``cdcore.kernels.parts`` spares), the triangle test took 35 s instead of 6. And it takes an array
apart into seven numbers: with addresses instead (``cdcore.kernels.memory``) the first exact answer compiles in two
thirds of the time (2026-11).
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryFile
from time import perf_counter
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba import njit, types
from numba.core import event
from numba.extending import intrinsic, lower_builtin, register_jitable, type_callable
from numpy.typing import NDArray
from platformdirs import user_cache_path

from cdcore.kernels.machine_code import MachineCodeFiles

Function = TypeVar("Function", bound=Callable[..., Any])

NUMBA_SETTINGS: Final[Any] = numba.config

INTERPRETED: Final = bool(NUMBA_SETTINGS.DISABLE_JIT)
"""Whether kernels run as the Python functions that they are, for a debugger or to measure coverage: slowly, with the
same answers. Set by ``NUMBA_DISABLE_JIT=1``."""

OLDEST_TRIED: Final = (0, 61)
NEWEST_TRIED: Final = (0, 68)
"""Versions of numba with which the tests of ``cdcore.kernels.parts`` pass."""

# Nobody calls the wrapper for C callers that is made of every kernel, no kernel has array expressions to rewrite, and
# divisions that check for zero branch: together a third of the time to compile.
JIT_OPTIONS: Final[dict[str, Any]] = {
    "nogil": True,
    "no_cfunc_wrapper": True,
    "no_rewrites": True,
    "error_model": "numpy",
}
"""Options of ``njit`` for every kernel and part of a kernel."""

SOURCES: Final = (
    "kernels/*.py", "poses/*.py", "triangles/*.py", "image_space/*.py", "broad/*.py", "narrow/**/*.py",
    "containment/*.py", "search/*.py", "numerics.py", "protocol/verdict.py",
)  # fmt: skip
"""Files of kernels and of the constants that become part of them."""


@cache
def quick_compilers() -> tuple[dict[str, Any], dict[str, Any]]:
    """Options of ``njit`` for kernels and for parts of kernels; none for a numba that has not been tried.

    The quick way (``cdcore.kernels.parts``) overrides names that numba does not promise to keep. Without it kernels
    compute the same, and those that ``cdcore.detectors.compile_beside`` compiles take 36 s instead of 17 (2026-11).
    """
    if not OLDEST_TRIED <= numba.version_info.short <= NEWEST_TRIED:
        return {}, {}
    from cdcore.kernels.parts import KernelCompiler, PartCompiler

    return {"pipeline_class": KernelCompiler}, {"pipeline_class": PartCompiler}


@cache
def kernel_folder() -> Path | None:
    """Returns the folder for machine code of these sources, or ``None`` if nothing can be written.

    Machine code of earlier sources is removed.

    It is below ``NUMBA_CACHE_DIR`` if that is set, else beside the sources, else in the user's cache folder.
    """
    package = Path(__file__).parents[1]
    sources = sorted(file for name in SOURCES for file in package.glob(name))
    content = sha256(b"".join(file.read_bytes() for file in sources)).hexdigest()[:12]
    # Two installations may share a folder of the user's.
    installation = f"vrlab-kernels-{sha256(str(package).encode()).hexdigest()[:8]}"
    given = NUMBA_SETTINGS.CACHE_DIR
    parents = [Path(given)] if given else [package / "__pycache__", user_cache_path("vrlab-replay", appauthor=False)]
    for parent in parents:
        folder = parent / f"{installation}-{content}"
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            TemporaryFile(dir=folder).close()
            for earlier in parent.glob(f"{installation}-*"):
                if earlier != folder:
                    rmtree(earlier, ignore_errors=True)
            return folder
    return None


def kernel(function: Function) -> Function:
    """Compile on first use, without the interpreter's lock; keep the machine code for later starts.

    Where kernels are interpreted, numbers overflow and divide by zero as silently as in machine code.
    """
    if INTERPRETED:
        return np.errstate(all="ignore")(function)
    made: Any = njit
    compiled = made(**JIT_OPTIONS, **quick_compilers()[0])(function)
    folder = kernel_folder()
    if folder is None:
        return cast(Function, compiled)
    given = NUMBA_SETTINGS.CACHE_DIR
    NUMBA_SETTINGS.CACHE_DIR = str(folder)
    try:
        compiled.enable_caching()
    finally:
        NUMBA_SETTINGS.CACHE_DIR = given
    _verify_machine_code(compiled._cache)
    return cast(Function, compiled)


def _verify_machine_code(cache: Any) -> None:
    """Let numba keep the machine code of a kernel in files that are verified before it loads them.

    A numba without the names that this takes keeps nothing: unverified files can end the process.
    """
    if not hasattr(cache, "_cache_file") or not hasattr(cache, "_impl"):
        cache.disable()
        return
    cache._cache_file = MachineCodeFiles(
        folder=Path(cache.cache_path),
        name=cache._impl.filename_base,
        source_stamp=cache._impl.locator.get_source_stamp(),
    )
    cache.load_overload = _or_nothing(cache.load_overload)
    cache.save_overload = _or_nothing(cache.save_overload)


def _or_nothing(step: Callable[..., Any]) -> Callable[..., Any]:
    """Errors of the disk cost a start its time, and no run its answer."""

    def tried(*given: Any) -> Any:
        with suppress(Exception):
            return step(*given)

    return tried


def hot_kernel(function: Function) -> Function:
    """A plain Python function that kernels compile as a part of themselves: a disk keeps it with them.

    Compiled, it allocates nothing and so counts no references to its arrays, which is twice as fast where arrays are
    many: counting is atomic, and taking an array out of a named tuple counts. It cannot call itself.
    """
    if INTERPRETED:
        return function
    options = JIT_OPTIONS | {"_nrt": False, "no_cpython_wrapper": True} | quick_compilers()[1]
    mark_as_callee: Any = register_jitable(**options)
    return cast(Function, mark_as_callee(function))


class Compiled(event.Listener):
    """Listens to numba: how many kernels were compiled, and how long that took.

    ``tell`` is called with the seconds spent so far, when a kernel is about to compile. Meanwhile the garbage
    collector rests: a compiler makes many objects that live and few cycles, and the search for cycles took a tenth of
    its time (2026-11).
    """

    def __init__(self, tell: Callable[[float], None]) -> None:
        self.kernels = 0
        self.seconds = 0.0
        self.folder: str | None = None
        """Where later starts find the machine code; ``None`` if nothing could be written."""
        self._tell, self._depth, self._since, self._collects = tell, 0, 0.0, False

    def on_start(self, event: Any) -> None:
        """A kernel is about to compile; numba holds its compiler's lock meanwhile."""
        self._depth += 1
        if self._depth > 1:
            return
        compiled = event.data["dispatcher"]
        if compiled.py_func.__module__.startswith("cdcore."):
            self.kernels += 1
            self.folder = compiled.stats.cache_path
            self._tell(self.seconds)
        self._collects = gc.isenabled()
        gc.disable()
        self._since = perf_counter()

    def on_end(self, _event: Any) -> None:
        """A kernel is compiled."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += perf_counter() - self._since
            if self._collects:
                gc.enable()


@contextmanager
def compiling_reported(tell: Callable[[float], None]) -> Iterator[Compiled]:
    """Inside this context ``tell`` is called for each kernel that is compiled because no disk has it yet."""
    heard = Compiled(tell)
    listen: Any = event.register
    forget: Any = event.unregister
    listen("numba:compile", heard)
    try:
        yield heard
    finally:
        forget("numba:compile", heard)


Operation = TypeVar("Operation", bound=Callable[..., Any])


def machine_operation(typed: Callable[..., Any], interpreted: Operation) -> Operation:
    """An operation of kernels: numba's ``intrinsic`` from what types and writes it, or its body in Python.

    Both are given, and give the same bits; ``interpreted`` is an attribute of the operation.
    """
    if INTERPRETED:
        return interpreted
    operation: Any = cast(Any, intrinsic)(typed)
    operation.interpreted = interpreted
    return cast(Operation, operation)


def records(rows: NDArray[np.void]) -> NDArray[np.void]:
    """Records whose fields kernels read as attributes, interpreted too."""
    return rows.view(np.recarray) if INTERPRETED else rows


def never_inlined() -> None:
    """Called once in a kernel's body: the kernel is not inlined into its callers. Python does nothing."""


def always_inlined() -> None:
    """Called once in a kernel's body: the kernel is inlined wherever it is called. Python does nothing."""


def _mark_when_compiled(mark: Callable[[], None], attribute: str) -> None:
    """Let a call of ``mark`` give the compiled function that calls it an attribute of LLVM."""

    def typed(_context: Any) -> Any:
        return lambda: types.void

    def lowered(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        builder.function.attributes.add(attribute)
        return context.get_dummy_value()

    register_type: Any = cast(Any, type_callable)(mark)
    register_code: Any = cast(Any, lower_builtin)(mark)
    register_type(typed)
    register_code(lowered)


if not INTERPRETED:
    _mark_when_compiled(never_inlined, "noinline")
    _mark_when_compiled(always_inlined, "alwaysinline")
