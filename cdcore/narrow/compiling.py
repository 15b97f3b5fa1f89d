"""How the kernels of the narrow phase are compiled: once per machine, again when any of their sources changes.

numba keeps machine code beside the source, or in the user's cache folder where the installation cannot be written, and
looks at the one file a kernel stands in. Kernels call each other across files, so here a change in any file counts.

Two habits of the compiler make the exact predicates expensive to compile: it copies them into each of their many call
sites, and it makes a version of a function for every literal number it is called with. Without the first mark below,
and with literal row numbers (written here as ``o + 1`` with a computed ``o``), the triangle test took 35 s to compile
instead of 6.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit, types
from numba.extending import intrinsic

Function = TypeVar("Function", bound=Callable[..., Any])


@cache
def _sources_stamp(own: Path) -> tuple[tuple[str, int, int], ...]:
    """Name, time and size of every source file that kernels of a folder may come from: that folder and this one."""
    folder = Path(__file__).parent
    beside = [] if folder in (own, *own.parents) else sorted(own.glob("*.py"))
    files = [*sorted(folder.rglob("*.py")), *beside, folder.parent / "numerics.py"]
    return tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in files if file.exists())


def kernel(function: Function) -> Function:
    """Compile on first use, without the interpreter's lock; keep the machine code for later starts."""
    return _compiled(function, {})


def hot_kernel(function: Function) -> Function:
    """A kernel that allocates nothing and so counts no references to its arrays: twice as fast where arrays are many.

    Counting is atomic, and taking an array out of a named tuple counts. Kernels alone can call it: a wrapper for
    Python is left out to compile sooner.
    """
    return _compiled(function, {"_nrt": False, "no_cpython_wrapper": True})


def _compiled(function: Function, options: dict[str, Any]) -> Function:
    made: Any = njit
    # a wrapper for C callers is made of every kernel, and nobody calls it: a fifth of the time to compile
    compiled = made(cache=True, nogil=True, no_cfunc_wrapper=True, **options)(function)
    files = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if files is not None and hasattr(files, "_source_stamp"):
        own = Path(function.__code__.co_filename).parent
        files._source_stamp = (files._source_stamp, _sources_stamp(own))
    return cast(Function, compiled)


def are_compiled(kernels: Sequence[Callable[..., Any]]) -> bool:
    """Whether machine code of all these kernels is in memory or on disk, so that their first call does not compile."""
    return all(_is_compiled(one) for one in kernels)


def _is_compiled(compiled: Any) -> bool:
    if getattr(compiled, "signatures", None):
        return True
    try:
        return len(compiled._cache._cache_file._load_index()) > 0
    except (AttributeError, OSError):
        return False


def machine_operation(typed: Callable[..., Any]) -> Callable[..., Any]:
    """An operation of kernels from what types and writes it: numba's ``intrinsic``, callable as the kernels call it."""
    return cast(Callable[..., Any], intrinsic(typed))


def _marked(attribute: str) -> Callable[[], None]:
    def typed(_context: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            builder.function.attributes.add(attribute)
            return context.get_dummy_value()

        return types.void(), generate

    return machine_operation(typed)


stay_one_function = _marked("noinline")
"""Called once in a kernel's body: the kernel is not inlined into its callers. Kernels only; it has no Python body."""

become_part_of_caller = _marked("alwaysinline")
"""Called once in a kernel's body: the kernel is inlined wherever it is called."""
