"""What detectors got wrong as tables: a row per numbered miss, and per numbered false contact."""

from typing import Final

import numpy as np
import pyarrow as pa

from replay.outputs.results.parquet import columns_of
from replay.outputs.results.parquet_tables import heads_of, in_noise
from replay.pipeline.diagnosis import why
from replay.pipeline.run_result import RunResult


def miss_table(result: RunResult) -> pa.Table:
    """Every numbered miss of every audited detector, with the geometry of its deepest frame (metres, world).

    Of a contact that no frame shows ``touch`` says when, in seconds, it begins between the frames ``first`` - 1 and
    ``first``: not before ``touch_free``. ``face_a`` and ``face_b`` touch first; point and normal are of that moment.
    ``noise`` and ``noise_share`` are those of the contact; ``why`` is the sentence about it.
    """
    rows = [(label, miss) for label, found in result.misses.items() for miss in found]
    values = []
    for label, miss in rows:
        touch = (None,) * 4 if miss.touch is None else (miss.touch.moment, *miss.touch.faces, miss.touch.free)
        noise = in_noise(result, miss.episode)
        reason = why(result, label, result.summary["detectors"][label], miss)
        own = (getattr(miss, name) for name in MISS_COLUMNS)
        values.append([*own, *miss.point, *miss.normal, *touch, *noise, reason])
    heads = heads_of(result, [(label, miss.number, miss) for label, miss in rows])
    return pa.table(heads | columns_of(values, MISS_COLUMNS | MISS_MEASURES))


MISS_COLUMNS: Final[dict[str, type]] = {
    "first": int, "last": int, "start": float, "end": float, "kind": str, "episode": int, "deepest": int,
    "face_pairs": int, "cut_length": float, "cause": str,
}  # fmt: skip
"""Columns that are attributes of a miss."""

MISS_MEASURES: Final[dict[str, type]] = {
    **dict.fromkeys([f"{name}_{axis}" for name in ("point", "normal") for axis in "xyz"], float),
    "touch": float, "face_a": int, "face_b": int, "touch_free": float, "noise": str, "noise_share": float, "why": str,
}  # fmt: skip


def false_table(result: RunResult) -> pa.Table:
    """Every numbered false contact of every audited detector.

    ``gap`` is in metres between the meshes at frame ``widest``, where they are farthest apart of the frames looked at,
    and ``point_x`` to ``point_z`` is the middle of it (world); null: not measured. ``why`` is the sentence about it.
    """
    rows = [(label, one) for label, found in result.false.items() for one in found]
    measured = [None if np.isnan(one.gap) else one.gap for _, one in rows]
    values = [
        [
            *(getattr(one, name) for name in FALSE_COLUMNS),
            *one.point,
            gap,
            why(result, label, result.summary["detectors"][label], one),
        ]
        for (label, one), gap in zip(rows, measured, strict=True)
    ]
    heads = heads_of(result, [(label, one.number, one) for label, one in rows])
    return pa.table(heads | columns_of(values, FALSE_COLUMNS | FALSE_MEASURES))


FALSE_COLUMNS: Final[dict[str, type]] = {
    "first": int, "last": int, "start": float, "end": float, "kind": str, "widest": int, "cause": str,
}  # fmt: skip
"""Columns that are attributes of a false contact."""

FALSE_MEASURES: Final[dict[str, type]] = {
    **dict.fromkeys(("point_x", "point_y", "point_z", "gap"), float), "why": str,
}  # fmt: skip
