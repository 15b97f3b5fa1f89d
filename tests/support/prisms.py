"""Prisms whose outermost points along X are exact."""

import numpy as np

from sessions.geometry.rings import sewn


def prism(sides, radius, length):
    """A regular prism along Y about the origin; of its ``sides``, an even number, one corner lies on +X, one on -X."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    outline = radius * np.column_stack([np.cos(angle), np.zeros(sides), np.sin(angle)])
    outline[[0, sides // 2]] = [radius, 0.0, 0.0], [-radius, 0.0, 0.0]
    half = np.array([0.0, length / 2.0, 0.0])
    return sewn([-half[None], outline - half, outline + half, half[None]])
