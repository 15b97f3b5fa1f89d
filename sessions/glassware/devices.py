"""Tracked devices of a student: hands, and a wand and a headset in the manner of the VIVE.

The meshes were made once, by ``python .ci/device_meshes.py``, and are shipped with many faces and with some 3,000; the
finer or the coarser one is simplified to the number asked for. The hands hold a cylinder whose axis is +Y through the
origin, so a hand's pose in a scene is the pose of the thing it holds: put the origin on the axis of a beaker at the
height of the grip.
"""

from functools import lru_cache
from itertools import accumulate, repeat
from operator import mul
from pathlib import Path
from typing import Final

import numpy as np

from sessions.glassware.instrument import Instrument, weighed_instrument
from sessions.glassware.united import fitted_mesh
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import load_mesh, refined_mesh, simplified_mesh

FOLDER: Final = Path(__file__).with_name("device_meshes")
GRIPS: Final = (0.008, 0.01, 0.02, 0.03, 0.034, 0.045)
"""Radii in metres of the cylinders that there are hands for: two rods, a test tube, three beakers."""

WAND_MASS, HEADSET_MASS = 0.2, 0.5  # kg, round figures for hollow plastic; the meshes are solid

TOLERANCES: Final = tuple(accumulate(repeat(1.15, 37), mul, initial=1e-4))
"""Metres by which a mesh is simplified step after step: one large step stalls at 730 faces."""
COARSE_STEPS: Final = {"hand": 12, "headset": 18, "wand": 11}
"""After so many steps, with little more than 3,000 faces, a mesh is shipped once more: they take most of the time."""
SPLIT_M = 4e-3  # The first length tried that edges are split to where more faces are asked for


def hand_right(faces: int, *, grip_radius: float = 0.030) -> Instrument:
    """Return a right hand about a cylinder of about ``grip_radius``, the nearest of `GRIPS`: thumb up, fingers forward
    (-Z) and round to -X."""
    return _hand("hand_right", faces, grip_radius, 1.0)


def hand_left(faces: int, *, grip_radius: float = 0.030) -> Instrument:
    """Return a left hand, the mirror image of `hand_right` in X."""
    return _hand("hand_left", faces, grip_radius, -1.0)


def proxy_wand(faces: int) -> Instrument:
    """Return a wand: handle towards +Z, trackpad up, trigger below, an open ring in front, tilted forward.

    The origin lies under the trackpad, where the handle meets the ring.
    """
    return weighed_instrument("proxy_wand", _shipped_mesh("wand", faces), "controller tool", mass=WAND_MASS)


def proxy_headset(faces: int) -> Instrument:
    """Return a headset that looks towards -Z, with straps round the head; the origin lies between the eyes."""
    return weighed_instrument("proxy_headset", _shipped_mesh("headset", faces), "headset", mass=HEADSET_MASS)


def _hand(name: str, faces: int, grip_radius: float, side: float) -> Instrument:
    grip = min(GRIPS, key=lambda radius: abs(radius - grip_radius))
    mesh = _shipped_mesh(f"hand_{1e3 * grip:.0f}", faces)
    if side < 0.0:
        mesh = mesh.transformed(np.diag([-1.0, 1.0, 1.0, 1.0]))
    return weighed_instrument(name, mesh, f"hand {name.removeprefix('hand_')}", "tissue")


@lru_cache(maxsize=16)
def _shipped_mesh(name: str, faces: int) -> MeshData:
    """A shipped mesh with about ``faces`` faces, made once: scenes ask for the same hand on both sides."""
    mesh, tolerances = load_mesh(FOLDER / f"{name}_coarse.glb"), TOLERANCES[COARSE_STEPS[name.partition("_")[0]] :]
    if len(mesh.faces) <= faces:
        mesh, tolerances = load_mesh(FOLDER / f"{name}.glb"), TOLERANCES
    if faces > len(mesh.faces):
        return fitted_mesh(lambda length: refined_mesh(mesh, length), faces, SPLIT_M)[0]
    before = after = mesh
    for tolerance in tolerances:
        if len(after.faces) <= faces:
            break
        before, after = after, simplified_mesh(after, tolerance)
    return min(before, after, key=lambda trial: abs(np.log(len(trial.faces) / faces)))
