"""A kernel reads and writes through an address what the array holds there."""

import numpy as np
import pytest
from numba.core.errors import TypingError

from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import address_of, bytes_at, doubles_at, doubles_of, integers_at, row_of, words_at, words_of
from cdcore.narrow.spacetime.simd import load8, store


@kernel
def doubled(row, count):
    small, middle, large, real = bytes_at(row[0]), integers_at(row[1]), words_at(row[2]), doubles_at(row[3])
    for k in range(count):
        small[k] = 2 * small[k]
        large[k] = 2 * large[k] + middle[k]
    value = load8(real, 1)
    store(real, 0 * count, value)
    return real[count]


def test_every_kind_of_number_is_read_and_written_in_place():
    arrays = [np.arange(12).astype(kind) for kind in (np.uint8, np.int32, np.int64, np.float64)]
    assert doubled(row_of(arrays), 10) == 10.0
    assert arrays[0].tolist() == [*range(0, 20, 2), 10, 11]
    assert arrays[1].tolist() == list(range(12))
    assert arrays[2].tolist() == [*range(0, 30, 3), 10, 11]
    assert arrays[3].tolist() == [*range(1, 9), *range(8, 12)]


@kernel
def last_of_rows(real, whole):
    return doubles_of(real)[5], words_of(whole)[5], doubles_of(doubles_of(real))[0]


def test_an_array_of_rows_is_one_row_in_a_kernel():
    assert last_of_rows(np.arange(6.0).reshape(2, 3) + 1, np.arange(6).reshape(3, 2)) == (6.0, 5, 1.0)


def test_a_row_keeps_numbers_as_they_are():
    array = np.zeros(3)
    assert row_of([7, array]).tolist() == [7, array.ctypes.data] == [7, address_of(array)]


def test_an_array_with_gaps_has_no_address():
    with pytest.raises(AssertionError):
        address_of(np.zeros((4, 4))[:, 1])


def test_a_kernel_takes_no_address_of_an_array_with_gaps():
    with pytest.raises(TypingError, match="make this one contiguous first"):
        last_of_rows(np.zeros((6, 2))[:, 0], np.zeros(6, dtype=np.int64))
