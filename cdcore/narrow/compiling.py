"""Keeps compilation short: a marked kernel stays one function of machine code instead of being copied into its callers.

Two habits of the compiler make the exact predicates expensive to compile: it copies them into each of their many call
sites, and it makes a version of a function for every literal number it is called with. Without the mark below, and with
literal row numbers (written here as ``o + 1`` with a computed ``o``), the triangle test took 35 s to compile instead
of 6.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types
from numba.extending import intrinsic


def _stay_one_function(_context: Any) -> Any:
    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate


stay_one_function: Callable[[], None] = intrinsic(_stay_one_function)
"""Called once in a kernel's body: the kernel is not inlined into its callers. Kernels only; it has no Python body."""
