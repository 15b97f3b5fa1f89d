"""When a body stands over a flame: for the effect heat, and for the ledger where the body holds a liquid."""

from collections.abc import Mapping

import numpy as np

from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.output import FloatArray
from replay.effects.spans import BoolArray, FrameRange, steady_spans

Tables = Mapping[str, tuple[Declaration, ...]]


def spans_over_flame(inputs: EffectInputs, declared: Declaration) -> list[FrameRange]:
    """Frames in which the body stands over the flame of a table of heat."""
    return steady_spans(_is_over_flame(inputs, declared), np.ones(len(inputs), dtype=np.bool_))


def flame_power(declared: Declaration, spans: list[FrameRange], count: int) -> FloatArray:
    """Watts (T,) that the flame gives the body, each from its frame to the next."""
    power = np.zeros(count)
    for begin, stop in spans:
        power[begin:stop] = declared["power_w"]
    return power


def flames_under_liquids(tables: Tables) -> tuple[Declaration, ...]:
    """Tables of flames under vessels that an effect mixing follows: the ledger has their heat."""
    followed = {name for table in tables.get("mixing", ()) for name in table["in"]}
    return tuple(table for table in tables.get("heat", ()) if table["of"] == "flame" and table["heats"] in followed)


def heat_of_ledger(tables: Tables) -> Declaration | None:
    """The table of heat by which the ledger follows temperatures; ``None``: it follows none."""
    liquids = [table for table in tables.get("heat", ()) if table["of"] != "flame"]
    return next(iter((*liquids, *flames_under_liquids(tables))), None)


def _is_over_flame(inputs: EffectInputs, declared: Declaration) -> BoolArray:
    """(T,) whether the body's origin is above the flame's foot and near its axis; where not seen, as last seen."""
    lamp, dish = (inputs.poses(declared[key]).last_known() for key in ("source", "heats"))
    local = lamp.to_body_frame(dish.translation) - np.array(declared["base"])
    is_near_axis = np.hypot(local[:, 0], local[:, 2]) < declared["within"]
    is_above_foot = (local[:, 1] > 0.0) & (local[:, 1] <= declared["height"])
    return is_near_axis & is_above_foot & lamp.valid & dish.valid
