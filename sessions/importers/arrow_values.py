"""Values of Python and NumPy to Arrow and back, by buffers.

``pyarrow.array``, ``pyarrow.scalar`` and ``to_numpy`` import pandas where it is installed, to ask whether their input
is of pandas: that takes as long as the rest of an import of a minute (0.27 of 0.55 s).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray


def bool_array(values: NDArray[np.bool_]) -> pa.BooleanArray:
    """Returns flags (n,) as an Arrow array, which holds eight of them in a byte."""
    bits = np.packbits(values, bitorder="little")
    return pa.Array.from_buffers(pa.bool_(), len(values), [None, pa.py_buffer(bits)])


def text_array(texts: Sequence[str]) -> pa.StringArray:
    """Returns texts as an Arrow array."""
    encoded = [text.encode("utf-8") for text in texts]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(encoded), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded)))


def text_scalar(text: str | None) -> pa.StringScalar:
    """Returns one text as an Arrow scalar; ``None``: the one that is missing."""
    return pa.nulls(1, pa.string())[0] if text is None else text_array([text])[0]


def float_values(cells: pa.ChunkedArray) -> NDArray[np.float64]:
    """Returns numbers of Arrow as float64 (n,); what is missing is NaN."""
    missing = text_scalar("nan").cast(pa.float64())
    return _values(pc.fill_null(cells.cast(pa.float64()), missing), np.float64)


def bool_values(flags: pa.ChunkedArray) -> NDArray[np.bool_]:
    """Returns flags of Arrow (n,); what is missing is no."""
    missing = text_scalar("0").cast(pa.uint8())
    return _values(pc.fill_null(flags.cast(pa.uint8()), missing), np.uint8).astype(np.bool_)


def _values(cells: pa.ChunkedArray, dtype: type[np.generic]) -> NDArray[Any]:
    chunks = [np.from_dlpack(chunk) for chunk in cells.chunks]
    return np.concatenate(chunks) if chunks else np.zeros(0, dtype=dtype)
