"""How kernels are compiled: once per machine, again when any of their sources changes.

Two habits of the compiler make kernels expensive to compile. It copies a function into each of its many call sites:
without the first mark below the triangle test took 35 s instead of 6. And it takes an array apart into seven numbers:
with addresses instead (``cdcore.kernels.memory``) the first exact answer compiles in two thirds of the time (2026-11).
What to avoid in a kernel: an array written to an array's slice compiles the sentence about shapes that differ, 3.8 s of
the demo's 20 (2026-11).
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import wraps
from time import perf_counter
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba import njit, types
from numba.core import event
from numba.extending import intrinsic, lower_builtin, overload, register_jitable, type_callable
from numpy.typing import NDArray

from cdcore.kernels.cache_seals import KernelCache

Function = TypeVar("Function", bound=Callable[..., Any])

NUMBA_SETTINGS: Final[Any] = numba.config

INTERPRETED: Final = bool(NUMBA_SETTINGS.DISABLE_JIT)
"""Whether kernels run as the Python functions that they are, for a debugger or to measure coverage: slowly, with the
same answers. Set by ``NUMBA_DISABLE_JIT=1``."""

ENGINE_COMPILES: Final = "cdcore:engine compiles"
"""Kind of event, beside numba's own, of an engine that compiles."""

# Nobody calls the wrapper for C callers that is made of every kernel, no kernel has array expressions to rewrite, and
# divisions that check for zero branch: together a third of the time to compile.
JIT_OPTIONS: Final[dict[str, Any]] = {
    "nogil": True,
    "no_cfunc_wrapper": True,
    "no_rewrites": True,
    "error_model": "numpy",
}
"""Options of ``njit`` for every kernel and part of a kernel."""

INNER_OPTIONS: Final[dict[str, Any]] = JIT_OPTIONS | {"no_cpython_wrapper": True}
"""Options for what only kernels call."""

# Their references to arrays need no counting, which is atomic, and took a sixth of the time to compile (2026-11).
CALLEE_OPTIONS: Final[dict[str, Any]] = INNER_OPTIONS | {"_nrt": False}
"""Options for what allocates nothing besides, as the documentation of ``numba.extending.register_jitable`` has it."""


def kernel(function: Function) -> Function:
    """Compile on first use, without the interpreter's lock; keep the machine code for later starts.

    The machine code lies where numba keeps it: below ``NUMBA_CACHE_DIR`` if that is set, else beside the sources, else
    in the user's cache folder. Errors of the disk cost a start its time, and no run its answer. Of several processes
    one compiles a kernel; the others wait and load it. Kernels may call each other. Where kernels are interpreted,
    numbers overflow and divide by zero as silently as in machine code.
    """
    if INTERPRETED:
        return np.errstate(all="ignore")(function)
    compiled, files = _with_cache(function)
    signatures_before = 0

    @wraps(function)
    def call(*arguments: Any) -> Any:
        nonlocal signatures_before
        if files and not signatures_before:
            with files.locked():
                with suppress(OSError):  # the disk is full: numba has compiled the kernel and could not write it
                    compiled.compile(tuple(map(numba.typeof, arguments)))
                signatures_before = len(compiled.overloads)
                if compiled.stats.cache_misses:
                    files.seal()
        try:
            answer = compiled(*arguments)
        except OSError:  # the same of another signature
            answer = compiled(*arguments)
        if len(compiled.overloads) != signatures_before:
            signatures_before = len(compiled.overloads)
            if files and compiled.stats.cache_misses:
                files.seal()
        return answer

    call.dispatcher = compiled  # type: ignore[attr-defined]
    make_callable: Any = overload
    callable_in_kernels = make_callable(call, jit_options=INNER_OPTIONS, strict=False)
    callable_in_kernels(lambda *_: function)
    return cast(Function, call)


def _with_cache(function: Function) -> tuple[Any, KernelCache | None]:
    """numba's dispatcher of a kernel, and the files of its cache, verified; ``None`` where nothing can be kept."""
    make: Any = njit
    try:
        compiled = make(cache=True, **JIT_OPTIONS)(function)
    except RuntimeError:  # no folder that numba tries can be written
        return make(**JIT_OPTIONS)(function), None
    files = KernelCache.of(function, compiled.stats.cache_path)
    if not files.remove_unless_intact():
        return make(**JIT_OPTIONS)(function), None
    return compiled, files


def hot_kernel(function: Function) -> Function:
    """A plain Python function that kernels compile as a part of themselves: a disk keeps it with them.

    It allocates nothing, returns no array to a kernel, which would free it, and cannot call itself.
    """
    if INTERPRETED:
        return function
    mark_as_callee: Any = register_jitable(**CALLEE_OPTIONS)
    return cast(Function, mark_as_callee(function))


class Compiled(event.Listener):
    """Listens to numba and to engines: how many kernels were compiled, and how long that took.

    ``tell`` is called with the seconds spent so far, when a kernel is about to compile. Meanwhile the garbage
    collector rests: a compiler makes many objects that live and few cycles, and the search for cycles took a tenth of
    its time (2026-11).
    """

    def __init__(self, tell: Callable[[float], None]) -> None:
        self.kernels = 0
        self.seconds = 0.0
        self.folder: str | None = None
        """Where later starts find the machine code; ``None`` if nothing could be written."""
        self.engine = ""
        """Name of the engine whose own compiler works; empty: numba does."""
        self._tell, self._depth, self._since, self._collects = tell, 0, 0.0, False

    def on_start(self, event: Any) -> None:
        """A kernel is about to compile; numba holds its compiler's lock meanwhile."""
        self._depth += 1
        if self._depth > 1:
            return
        self.engine = event.data.get("engine", "")
        if self.engine:
            self.kernels += 1
            self.folder = event.data["folder"]
            self._tell(self.seconds)
        elif (compiled := event.data["dispatcher"]).py_func.__module__.startswith("cdcore."):
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
    for kind in ("numba:compile", ENGINE_COMPILES):
        listen(kind, heard)
    try:
        yield heard
    finally:
        for kind in ("numba:compile", ENGINE_COMPILES):
            forget(kind, heard)


def engine_compiles(engine: str, folder: str) -> AbstractContextManager[None]:
    """Report to ``compiling_reported`` that an engine compiles in this context, whose machine code goes to a folder."""
    trigger: Any = event.trigger_event
    return cast("AbstractContextManager[None]", trigger(ENGINE_COMPILES, data={"engine": engine, "folder": folder}))


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
