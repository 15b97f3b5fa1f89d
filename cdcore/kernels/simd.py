"""Eight (or four) doubles as one value inside compiled kernels: one machine instruction or two answer for eight frames.

The operations exist in kernels only. A plain double among the operands stands for that double in every lane.
Comparisons give one bit per lane as an integer, bit k for lane k; a comparison with NaN gives 0.

Every step rounds: no multiplication is fused with an addition, so that every machine, and Python, gives the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import models, register_model

from cdcore.kernels.compiling import machine_operation

LANES = 8
"""Frames per block: 1, 2 and 4 were 2.6, 1.8 and 1.3 times slower on 50,000 faces, 16 no faster."""

Lanes = Any
"""What a kernel's author writes for a value of several doubles."""


class LanesType(types.Type):
    """numba's name for a vector of doubles."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"lanes{width}")


eight, four = LanesType(8), LanesType(4)


def _vector(kind: Any) -> Any:
    return ir.VectorType(ir.DoubleType(), kind.width)


@register_model(LanesType)
class LanesModel(models.PrimitiveModel):
    """The vector lives in vector registers."""

    def __init__(self, manager: Any, kind: Any) -> None:
        start: Any = super().__init__
        start(manager, kind, _vector(kind))


def _spread(builder: Any, kind: LanesType, value: Any) -> Any:
    undefined = ir.Constant(_vector(kind), ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), kind.width), [0] * kind.width)
    return builder.shuffle_vector(first, undefined, zeros)


def _widest(kinds: Any) -> Any:
    return next((kind for kind in kinds if isinstance(kind, LanesType)), types.float64)


class _Machine:
    """Writes one operation: operands of the widest kind among them, plain doubles repeated."""

    def __init__(self, context: Any, builder: Any, kinds: Any, arguments: Any) -> None:
        self.builder, self.kind = builder, _widest(kinds)
        self.operands = [
            value if kind is self.kind else self.spread(context.cast(builder, value, kind, types.float64))
            for kind, value in zip(kinds, arguments, strict=True)
        ]

    def spread(self, value: Any) -> Any:
        return _spread(self.builder, self.kind, value)

    def call(self, name: str, *operands: Any) -> Any:
        lanes = isinstance(self.kind, LanesType)
        kind = _vector(self.kind) if lanes else ir.DoubleType()
        full_name = f"llvm.{name}.v{self.kind.width}f64" if lanes else f"llvm.{name}.f64"
        module = self.builder.module
        function = module.globals.get(full_name)
        if function is None:
            function = ir.Function(module, ir.FunctionType(kind, [kind] * len(operands)), full_name)
        return self.builder.call(function, operands)

    def bits(self, larger: Any, smaller: Any) -> Any:
        compared = self.builder.fcmp_ordered(">", larger, smaller)
        return self.builder.zext(self.builder.bitcast(compared, ir.IntType(self.kind.width)), ir.IntType(64))

    def chosen(self, relation: str, a: Any, b: Any) -> Any:
        return self.builder.select(self.builder.fcmp_ordered(relation, a, b), a, b)

    def dot(self, a: Any, b: Any) -> Any:
        total = self.builder.fmul(a[0], b[0])
        for k in range(1, len(a)):
            total = self.builder.fadd(total, self.builder.fmul(a[k], b[k]))
        return total


def _intrinsic(
    operands: str, typed: Callable[..., Any], write: Callable[..., Any], interpreted: Callable[..., Any]
) -> Callable[..., Any]:
    """An operation of kernels, one letter per operand: its type from the operands' kinds, what writes it, and its body
    in Python, where lanes are an array.
    """

    def signature_and_code(_context: Any, *kinds: Any) -> Any:
        return typed(*kinds), write

    parameters = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in ("_context", *operands)]
    signature_and_code.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return machine_operation(signature_and_code, interpreted)


def _operation(
    operands: str, write: Callable[..., Any], interpreted: Callable[..., Any], result: Any = None
) -> Callable[..., Any]:
    """An operation on the widest kind among its operands, which is also its kind unless ``result`` is."""

    def typed(*kinds: Any) -> Any:
        return (result or _widest(kinds))(*kinds)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        machine = _Machine(context, builder, signature.args, arguments)
        return write(machine, *machine.operands)

    return _intrinsic(operands, typed, generate, interpreted)


def _write_minor(m: _Machine, a: Any, b: Any, c: Any, d: Any) -> Any:
    return m.builder.fsub(m.builder.fmul(a, b), m.builder.fmul(c, d))


def _write_excess(m: _Machine, a: Any, b: Any) -> Any:
    return m.chosen(">", m.builder.fsub(m.call("fabs", a), b), m.spread(_ZERO))


_ZERO = ir.Constant(ir.DoubleType(), 0.0)
_select: Any = np.where


def _chosen(relation: np.ufunc, a: Lanes, b: Lanes) -> Lanes:
    return _select(relation(a, b), a, b)[()]


def _bits(larger: Lanes, smaller: Lanes) -> int:
    return sum(1 << k for k in np.flatnonzero(np.greater(larger, smaller)).tolist())


def _dot(a: Lanes, b: Lanes, c: Lanes, x: Lanes, y: Lanes, z: Lanes) -> Lanes:
    return a * x + b * y + c * z


plus = _operation("ab", lambda m, a, b: m.builder.fadd(a, b), lambda a, b: a + b)
minus = _operation("ab", lambda m, a, b: m.builder.fsub(a, b), lambda a, b: a - b)
times = _operation("ab", lambda m, a, b: m.builder.fmul(a, b), lambda a, b: a * b)
most = _operation("ab", lambda m, a, b: m.chosen(">", a, b), lambda a, b: _chosen(np.greater, a, b))
least3 = _operation(
    "abc",
    lambda m, a, b, c: m.chosen("<", m.chosen("<", a, b), c),
    lambda a, b, c: _chosen(np.less, _chosen(np.less, a, b), c),
)
most3 = _operation(
    "abc",
    lambda m, a, b, c: m.chosen(">", m.chosen(">", a, b), c),
    lambda a, b, c: _chosen(np.greater, _chosen(np.greater, a, b), c),
)
root = _operation("a", lambda m, a: m.call("sqrt", a), np.sqrt)
size = _operation("a", lambda m, a: m.call("fabs", a), np.abs)
"""The absolute value."""
fused = _operation("abc", lambda m, a, b, c: m.builder.fadd(m.builder.fmul(a, b), c), lambda a, b, c: a * b + c)
"""``fused(a, b, c)``: a b + c."""
dot = _operation("abcxyz", lambda m, *v: m.dot(v[:3], v[3:]), _dot)
"""``dot(a, b, c, x, y, z)``: a x + b y + c z, added in that order."""
moved = _operation("sabcxyz", lambda m, c, *v: m.builder.fadd(c, m.dot(v[:3], v[3:])), lambda s, *v: s + _dot(*v))
"""``moved(s, a, b, c, x, y, z)``: s + (a x + b y + c z)."""
minor = _operation("abcd", _write_minor, lambda a, b, c, d: a * b - c * d)
"""``minor(a, b, c, d)``: a b - c d."""
excess = _operation("ab", _write_excess, lambda a, b: _chosen(np.greater, np.abs(a) - b, 0.0))
"""``excess(a, b)``: how far |a| is above b, at least 0."""
above: Callable[..., int] = _operation("ab", lambda m, a, b: m.bits(a, b), _bits, types.int64)
"""``above(a, b)``: bit k where a > b in lane k."""
outside: Callable[..., int] = _operation(
    "ab", lambda m, a, b: m.bits(m.call("fabs", a), b), lambda a, b: _bits(np.abs(a), b), types.int64
)
"""``outside(a, b)``: bit k where |a| > b in lane k."""


def _shuffled(*addresses: int) -> Callable[[Lanes], Lanes]:
    order = ir.Constant(ir.VectorType(ir.IntType(32), 4), list(addresses))
    undefined = ir.Constant(_vector(four), ir.Undefined)
    return _operation("a", lambda m, a: m.builder.shuffle_vector(a, undefined, order), lambda a: a[list(addresses)])


following4 = _shuffled(1, 2, 0, 1)
"""Of three corners (and the first again) the ones that follow them around the face."""
first4 = _shuffled(0, 0, 0, 0)
"""The first corner in every lane."""


_INDEX, _LANE = ir.IntType(64), ir.IntType(32)
_many: Any = types.UniTuple


def _start(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Returns the address at which the first operand starts, an array or an address already."""
    kind, array = signature.args[0], arguments[0]
    return array if isinstance(kind, types.CPointer) else context.make_array(kind)(context, builder, array).data


def _lanes_at(context: Any, builder: Any, signature: Any, arguments: Any, kind: Any) -> Any:
    address = builder.gep(_start(context, builder, signature, arguments), [arguments[1]])
    return builder.bitcast(address, _vector(kind).as_pointer())


def _load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.load(_lanes_at(context, builder, signature, arguments, signature.return_type), align=8)


def _store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    builder.store(arguments[2], _lanes_at(context, builder, signature, arguments, signature.args[2]), align=8)
    return context.get_dummy_value()


def _doubles_from(context: Any, builder: Any, signature: Any, arguments: Any, first: Any, offsets: Any) -> list[Any]:
    start = _start(context, builder, signature, arguments)
    addresses = [builder.add(first, ir.Constant(_INDEX, offset)) for offset in offsets]
    return [builder.load(builder.gep(start, [address]), align=8) for address in addresses]


def _load3(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    values = _doubles_from(context, builder, signature, arguments, arguments[1], range(3))
    return context.make_tuple(builder, signature.return_type, values)


def _corners4(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    lanes = ir.Constant(_vector(four), ir.Undefined)
    values = _doubles_from(context, builder, signature, arguments, arguments[1], (0, 3, 6, 0))
    for lane, value in enumerate(values):
        lanes = builder.insert_element(lanes, value, ir.Constant(_LANE, lane))
    return lanes


def _splat8(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
    return _spread(builder, eight, arguments[0])


def _first3(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    values = [builder.extract_element(arguments[0], ir.Constant(_LANE, k)) for k in range(3)]
    return context.make_tuple(builder, signature.return_type, values)


def _entries(array: Any, first: int, count: int) -> Any:
    """A copy of consecutive entries of a contiguous array, counted through all of it."""
    return array.reshape(-1)[first : first + count].copy()


def _store_lanes(array: Any, index: int, value: Lanes) -> None:
    array.reshape(-1)[index : index + np.size(value)] = value


load8 = _intrinsic("ai", lambda array, _index: eight(array, types.intp), _load, lambda a, i: _entries(a, i, 8))
"""``load8(array, index)``: consecutive doubles of a contiguous array or an address, index in doubles from its start."""
load4 = _intrinsic("ai", lambda array, _index: four(array, types.intp), _load, lambda a, i: _entries(a, i, 4))
load3 = _intrinsic(
    "ai",
    lambda array, _index: _many(types.float64, 3)(array, types.intp),
    _load3,
    lambda a, i: tuple(_entries(a, i, 3)),
)
"""``load3(array, index)``: a point or a direction, three doubles."""
corners4 = _intrinsic(
    "ai", lambda array, _index: four(array, types.intp), _corners4, lambda a, i: _entries(a, i, 7)[[0, 3, 6, 0]]
)
"""``corners4(array, index)``: a coordinate of three corners (and the first again), rows of three doubles."""
first3 = _intrinsic("a", lambda lanes: _many(types.float64, 3)(lanes), _first3, lambda lanes: tuple(lanes[:3]))
"""The first three lanes as doubles."""
store = _intrinsic("aiv", lambda array, _index, value: types.void(array, types.intp, value), _store, _store_lanes)
"""``store(array, index, value)``."""
splat8 = _intrinsic("a", lambda _number: eight(types.float64), _splat8, lambda number: np.full(8, float(number)))
"""One double in every lane."""
