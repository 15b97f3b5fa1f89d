import pytest

from sessions.mcap_format.lazy import LazyMapping, LazySequence


def test_values_are_loaded_once_and_only_when_asked_for():
    loaded = []
    mapping = LazyMapping(["b", "a"], lambda key: loaded.append(key) or key.upper())
    assert list(mapping) == ["b", "a"] and len(mapping) == 2 and "a" in mapping and "c" not in mapping and loaded == []
    assert mapping["a"] == mapping["a"] == "A" and loaded == ["a"]
    with pytest.raises(KeyError):
        mapping["c"]
    assert dict(mapping) == {"b": "B", "a": "A"}


def test_a_sequence_is_loaded_once_at_its_first_use():
    loaded = []
    sequence = LazySequence(lambda: loaded.append(1) or [3, 4, 5])
    assert loaded == []
    assert sequence[1] == 4 and sequence[1:] == (4, 5) and len(sequence) == 3 and list(sequence) == [3, 4, 5]
    assert sequence == [3, 4, 5] and sequence != [3] and hash(sequence) == hash((3, 4, 5)) and loaded == [1]
