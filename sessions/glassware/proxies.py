"""Stand-ins for tracked devices: a wand and a headset in the manner of the VIVE, of our own geometry.

Real device models belong to their makers. These have the proportions that matter to contacts: a handle, a ring, a
face.
"""

from functools import lru_cache

import numpy as np

from sessions.glassware.field import (
    Distance,
    Points,
    blended,
    capsule,
    carved,
    ellipsoid,
    hoop,
    rounded_box,
    surface_of,
)
from sessions.glassware.instrument import Instrument, Site, weighed

WAND_MASS, HEADSET_MASS = 0.2, 0.5  # kg, round figures for hollow plastic; the meshes are solid
_surface_once = lru_cache(maxsize=8)(surface_of)


def proxy_wand(faces: int) -> Instrument:
    """Return a wand: handle towards +Z, trackpad up, trigger below, an open ring in front, tilted forward.

    The origin lies under the trackpad, where the handle meets the ring.
    """
    mesh = _surface_once(_wand, (-0.065, -0.085, -0.11), (0.065, 0.05, 0.165), faces)
    sites = {"grip": Site(point=(0.0, -0.018, 0.09), direction=(0.0, 0.0, 1.0))}
    origin = "under the trackpad"
    return weighed("proxy_wand", mesh, "controller tool", "plastic", mass=WAND_MASS, sites=sites, origin=origin)


def proxy_headset(faces: int) -> Instrument:
    """Return a headset that looks towards -Z, with straps round the head; the origin lies between the eyes."""
    mesh = _surface_once(_headset, (-0.12, -0.10, -0.11), (0.12, 0.13, 0.20), faces)
    sites = {"view": Site(point=(0.0, 0.0, 0.0), direction=(0.0, 0.0, -1.0))}
    origin = "between the eyes"
    return weighed("proxy_headset", mesh, "headset", "plastic", mass=HEADSET_MASS, sites=sites, origin=origin)


def _wand(points: Points) -> Distance:
    flat = points * np.array([0.82, 1.0, 1.0])
    neck = capsule(flat, (0.0, -0.008, -0.015), (0.0, -0.012, 0.045), 0.0185, 0.0165)
    handle = capsule(flat, (0.0, -0.012, 0.045), (0.0, -0.030, 0.138), 0.0160, 0.0150)
    wand = blended(neck, handle, 0.004)
    ring = hoop(points, (0.0, -0.022, -0.045), (0.0, 0.80, -0.60), 0.044, 0.0115, 0.0085)
    wand = blended(wand, ring, 0.010)
    bridge = capsule(points, (0.0, -0.012, 0.0), (0.0, -0.004, -0.012), 0.020, 0.017)
    wand = blended(wand, bridge, 0.008)
    # The hole stays open where the neck and the bridge would fill it.
    hole = capsule(points, (0.0, 0.042, -0.093), (0.0, -0.086, 0.003), 0.031, 0.031)
    before_handle = 0.006 - points[:, 2] - 0.75 * (points[:, 1] + 0.022)
    wand = carved(wand, np.maximum(hole, -before_handle), 0.004)
    groove = hoop(points, (0.0, 0.0085, 0.030), (0.0, 1.0, 0.14), 0.0165, 0.0016, 0.0035)
    pad = ellipsoid(points, (0.0, 0.0045, 0.030), (0.0160, 0.0050, 0.0160))
    wand = carved(blended(wand, pad, 0.001), groove, 0.001)
    for z in (0.003, 0.056):
        button = np.linalg.norm(points - np.array([0.0, 0.0045 - 0.1 * (z - 0.003), z]), axis=1) - 0.0048
        wand = blended(wand, button, 0.001)
    trigger = capsule(points, (0.0, -0.030, 0.012), (0.0, -0.040, 0.030), 0.0085, 0.0050)
    return blended(wand, trigger, 0.003)


def _headset(points: Points) -> Distance:
    body = rounded_box(points, (0.0, 0.0, -0.050), (0.088, 0.050, 0.040), 0.030)
    brow = ellipsoid(points, (0.0, 0.006, -0.072), (0.080, 0.044, 0.030))
    shell = blended(body, brow, 0.015)
    cushion = rounded_box(points, (0.0, 0.0, -0.004), (0.074, 0.044, 0.022), 0.018)
    shell = blended(shell, cushion, 0.006)
    face = ellipsoid(points, (0.0, 0.002, 0.030), (0.062, 0.036, 0.062))
    nose = capsule(points, (0.0, -0.075, 0.01), (0.0, -0.020, -0.012), 0.030, 0.010)
    shell = carved(carved(shell, face, 0.006), nose, 0.006)
    camera = np.linalg.norm(points - np.array([0.0, -0.030, -0.099]), axis=1) - 0.007
    shell = blended(shell, camera, 0.003)
    # Hollows of the sensors: two rows on the front, and the temples.
    dimples = [(x, y, -0.1065 + 4.5 * x * x) for y in (0.030, -0.008) for x in (-0.055, -0.028, 0.0, 0.028, 0.055)]
    dimples += [(sign * 0.094, y, -0.052) for sign in (-1.0, 1.0) for y in (0.022, -0.022)]
    for x, y, z in dimples:
        shell = carved(shell, np.linalg.norm(points - np.array([x, y, z]), axis=1) - 0.0095, 0.002)
    straps = np.minimum(_band(points), _crown(points))
    return blended(shell, straps, 0.008)


def _band(points: Points) -> Distance:
    """Return the strap that runs level round the head, an oval ribbon behind the face."""
    local = points - np.array([0.0, 0.012, 0.075])
    behind = np.maximum(local[:, 2], 0.0) * 0.078 / 0.105
    oval = np.column_stack([local[:, 0], behind])
    out = np.linalg.norm(oval, axis=1) - 0.080
    section = np.column_stack([out, local[:, 1] + 0.06 * local[:, 2], np.zeros_like(out)])
    ribbon = rounded_box(section, (0.0, 0.0, 0.0), (0.0060, 0.0150, 0.01), 0.0058)
    return np.maximum(ribbon, -0.100 - local[:, 2])


def _crown(points: Points) -> Distance:
    """Return the strap that runs over the head from the brow to the back."""
    local = points - np.array([0.0, 0.005, 0.075])
    oval = local[:, 1:]
    out = np.linalg.norm(oval, axis=1) - 0.107
    section = np.column_stack([local[:, 0], out, np.zeros_like(out)])
    ribbon = rounded_box(section, (0.0, 0.0, 0.0), (0.0140, 0.0060, 0.01), 0.0058)
    return np.maximum(ribbon, -local[:, 1] + 0.005)
