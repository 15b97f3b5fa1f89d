"""Parts of a session that are decoded the first time somebody asks for them, and never otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Generic, TypeVar, overload

Value = TypeVar("Value")


class LazyMapping(Mapping[str, Value], Generic[Value]):
    """A mapping whose keys are known and whose values are loaded one by one when asked for.

    Parameters
    ----------
    keys : the keys, in order.
    load : called once per key.
    """

    def __init__(self, keys: Sequence[str], load: Callable[[str], Value]) -> None:
        self._keys, self._load = dict.fromkeys(keys), load
        self._loaded: dict[str, Value] = {}

    def __getitem__(self, key: str) -> Value:
        if key not in self._keys:
            raise KeyError(key)
        if key not in self._loaded:
            self._loaded[key] = self._load(key)
        return self._loaded[key]

    def __contains__(self, key: object) -> bool:
        return key in self._keys

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)


class LazySequence(Sequence[Value], Generic[Value]):
    """A sequence that is loaded whole when its first item is asked for.

    Parameters
    ----------
    load : called once.
    """

    def __init__(self, load: Callable[[], Sequence[Value]]) -> None:
        self._load = load

    @cached_property
    def _items(self) -> tuple[Value, ...]:
        return tuple(self._load())

    @overload
    def __getitem__(self, index: int) -> Value: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Value]: ...
    def __getitem__(self, index: Any) -> Any:
        return self._items[index]

    def __len__(self) -> int:
        return len(self._items)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self._items == tuple(other)

    def __hash__(self) -> int:
        return hash(self._items)
