"""Kernels that only kernels call become parts of their callers: what a program calls is optimised once, as a whole.

numba optimises every function it compiles and makes machine code of it, with copies of all that it calls: of kernels
that call each other eight deep the innermost is optimised eight times. A part is written down and typed once, and
waits: the first exact answer compiles in 0.58 to 0.72 of the time (2026-11), and its kernels run as fast.

It overrides names that numba does not promise to keep, and is the only module that does: ``compiling.quick_compilers``
takes it for tried versions only.
"""

from functools import cache
from operator import getitem
from typing import Any, Final

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import BaseNativeLowering, NativeLowering

IDLE_PASSES: Final = frozenset({"InlineClosureLikes", "InlineOverloads"})
"""Steps of numba's compiler that look for what no kernel has, in 3 % of the time; a kernel has no closures."""


class KernelCompiler(Compiler):
    """numba's compiler without the steps that change no kernel, and with a memory for the types of what is called."""

    def __init__(self, typing: Any, *rest: Any) -> None:
        start: Any = super().__init__
        start(typing, *rest)
        self.state.typingctx = KnownFunctions(typing)

    def define_pipelines(self) -> list[Any]:
        """The steps, in numba's order."""
        usual: Any = super().define_pipelines
        return [_passes_for_kernels(steps) for steps in usual()]


class PartCompiler(KernelCompiler):
    """Compiles a kernel to a part of its callers, without machine code of its own."""

    def __init__(self, typing: Any, target: Any, _library: Any, *rest: Any) -> None:
        start: Any = super().__init__
        library: Any = PartLibrary
        start(typing, target, library(target.codegen(), "part of a kernel"), *rest)


class PartLibrary(JITCodeLibrary):
    """The code of one kernel, and of the parts it calls, as it was written: its callers' libraries optimise it."""

    @property
    def codegen(self) -> Any:
        """The stand-in for numba's code generator: a part has neither an address nor Python code."""
        return _Nowhere

    def get_pointer_to_function(self, _name: str) -> int:
        """0: there is no machine code here."""
        return 0

    def add_linking_library(self, library: Any) -> None:
        """Remember what this part calls."""
        self._linking_libraries.append(library)

    def _optimize_functions(self, _ll_module: Any) -> None:
        return

    def _ensure_finalized(self) -> None:
        return

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            for library in dict.fromkeys(self._linking_libraries):
                self._final_module.link_in(library._get_module_for_linking(), preserve=True)
            own: Any = super()._get_module_for_linking
            self._shared_module = own()
        return self._shared_module


class KnownFunctions:
    """numba's rules of typing, which answer what a function of numba gives for some operands' types from memory.

    Versions of a part for each number it is called with, and a function for each member taken out of a tuple, would
    take a sixth of the time to compile: parts are typed for all numbers, and a member has the type it has (2026-11).

    numba asks each of some six rules, once for the literal and once for the plain type, at every operator, ``abs`` and
    ``load8`` there is: a tenth of the time to compile for the operators, and as much for the others (2026-11).
    """

    def __init__(self, rules: Any) -> None:
        self._rules = rules

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rules, name)

    def resolve_function_type(self, function: Any, arguments: Any, keywords: Any) -> Any:
        """The signature that fits, as numba finds it."""
        # Operators come as the functions of Python that they are.
        kind = function if isinstance(function, types.Type) else self._rules.resolve_value_type(function)
        if function is getitem and _takes_member(*arguments):
            return arguments[0].types[arguments[1].literal_value](*arguments)
        if keywords or not isinstance(kind, types.Function):
            if isinstance(kind, types.Dispatcher):
                arguments = tuple(map(_for_all_numbers, arguments))
            return self._rules.resolve_function_type(function, arguments, keywords)
        return _signature_of(self._rules, kind, arguments)


@cache
def _signature_of(rules: Any, function: Any, arguments: Any) -> Any:
    return rules.resolve_function_type(function, arguments, {})


def _for_all_numbers(argument: Any) -> Any:
    # Else each literal number, and each width of an integer, would have its own version of what is called.
    return types.int64 if argument == types.int32 else getattr(argument, "literal_type", argument)


def _takes_member(value: Any, index: Any) -> bool:
    return isinstance(value, types.BaseTuple) and isinstance(index, types.IntegerLiteral)


class _Nowhere:
    """Takes the address of an environment and forgets it."""

    @staticmethod
    def set_env(_name: str, _environment: Any) -> None:
        return


class KernelLower(Lower):
    """Writes down the machine's instructions for one kernel; types that are known are not asked for again.

    Asking again at every operator took 10 to 14 % of the time to compile (2026-11).
    """

    def lower_binop(self, resty: Any, expr: Any, op: Any) -> Any:
        """The value of ``a op b``, as the type ``resty``; numba looks for constant operands of ``**`` besides."""
        kind_of: Any = self.typeof
        value_of: Any = self.loadvar
        function = self.context.typing_context.resolve_value_type(op)
        operand_types = self.fndesc.calltypes[expr].args
        operands = [
            self.context.cast(self.builder, value_of(operand.name), kind_of(operand.name), kind)
            for operand, kind in zip((expr.lhs, expr.rhs), operand_types, strict=True)
        ]
        signature = _signature_of(self.context.typing_context, function, operand_types)
        value = self.context.get_function(function, signature)(self.builder, operands)
        return self.context.cast(self.builder, value, signature.return_type, resty)

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """``value[index]``; a member of a tuple is taken out of it, where numba compiles and calls a function."""
        if not _takes_member(*signature.args):
            usual: Any = super().lower_getitem
            return usual(resty, expr, value, index, signature)
        value_of: Any = self.loadvar
        members, member_index = signature.args
        member = self.builder.extract_value(value_of(value.name), member_index.literal_value % len(members))
        if self.context.enable_nrt:
            self.context.nrt.incref(self.builder, signature.return_type, member)
        return self.context.cast(self.builder, member, signature.return_type, resty)


class KernelLowering(BaseNativeLowering):
    """numba's step that writes machine code, with ``KernelLower``."""

    _name: Any = "kernel_lowering"

    @property
    def lowering_class(self) -> Any:
        """The class that lowers one function."""
        return KernelLower


_register: Any = register_pass
_register(mutates_CFG=True, analysis_only=False)(KernelLowering)


def _passes_for_kernels(steps: Any) -> Any:
    kept = type(steps)(steps.pipeline_name)
    kept.passes.extend(
        (KernelLowering if step is NativeLowering else step, about)
        for step, about in steps.passes
        if step.__name__ not in IDLE_PASSES
    )
    kept.finalize()
    return kept


KERNEL_OPTIONS_OF_NUMBA: Final[dict[str, Any]] = {"pipeline_class": KernelCompiler}
"""Options of ``njit`` that it does not promise, for kernels."""

# Parts allocate nothing, so their references to arrays need no counting, which is atomic: twice as fast where arrays
# are many, since taking an array out of a named tuple counts.
PART_OPTIONS_OF_NUMBA: Final[dict[str, Any]] = {"pipeline_class": PartCompiler, "_nrt": False}
"""The same for parts of kernels."""
