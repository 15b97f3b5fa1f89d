"""What the paper printed, kept apart: no computed figure is made from these, they only stand beside them."""

from typing import Final

PRINTED: Final = "printed; hardware, budget, counting rule unknown"
"""Heading of every column that holds one of these values."""

OURS: Final = {"solid-style": "SOLID", "rapid-style": "RAPID", "hybrid-qaco": "paper's algorithm"}
"""Row here -> name in the paper."""

TABLE_1: Final[dict[str, dict[int, int]]] = {
    "solid-style": dict(zip(range(100, 1100, 100), (88, 186, 278, 342, 462, 512, 576, 694, 718, 802), strict=True)),
    "rapid-style": dict(zip(range(100, 1100, 100), (98, 190, 282, 370, 444, 512, 582, 658, 730, 802), strict=True)),
    "hybrid-qaco": dict(zip(range(100, 1100, 100), (100, 194, 294, 386, 474, 562, 656, 762, 858, 924), strict=True)),
}
"""Table I: row -> faces that intersect -> intersections detected."""

ACCURACY: Final = {"hybrid-qaco": 0.9529, "solid-style": 0.8467, "rapid-style": 0.8791}
"""Fig. 7: mean detection accuracy."""

VARIANCE: Final = {"hybrid-qaco": 0.020, "solid-style": 0.058, "rapid-style": 0.061}
"""Fig. 7, called "accuracy variance"; of the size of a standard deviation."""

TIME_TO_RAPID: Final = {"hybrid-qaco": 0.750, "solid-style": 0.795, "rapid-style": 1.0}
"""Fig. 7: 99 and 105 ms as shares of the 132 ms of RAPID."""
