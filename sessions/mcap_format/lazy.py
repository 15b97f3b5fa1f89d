"""Parts of a session that are decoded the first time somebody asks for them, and never otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, Generic, TypeVar, overload

Value = TypeVar("Value")


class LazyMapping(Mapping[str, Value], Generic[Value]):
    """A mapping with known keys; ``load`` is called once per key, when its value is asked for."""

    def __init__(self, keys: Sequence[str], load: Callable[[str], Value]) -> None:
        self._keys, self._load = dict.fromkeys(keys), cache(load)

    def __getitem__(self, key: str) -> Value:
        if key not in self._keys:
            raise KeyError(key)
        return self._load(key)

    def __contains__(self, key: object) -> bool:  # the mixin's own would load the value
        return key in self._keys

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)


class LazySequence(Sequence[Value], Generic[Value]):
    """A sequence that ``load`` gives whole when its first item is asked for."""

    def __init__(self, load: Callable[[], Sequence[Value]]) -> None:
        self._load = cache(lambda: tuple(load()))

    @overload
    def __getitem__(self, index: int) -> Value: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Value]: ...
    def __getitem__(self, index: Any) -> Any:
        return self._load()[index]

    def __len__(self) -> int:
        return len(self._load())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self._load() == tuple(other)

    def __hash__(self) -> int:
        return hash(self._load())
