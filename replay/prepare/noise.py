"""How far recorded poses may be from the truth: asked for in words, and copies drawn from it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdcore import Motion
from cdcore.numerics import BoolArray, FloatArray
from replay.errors import NoiseError
from replay.prepare.assembly import Assembly
from replay.prepare.flags import chain_of
from sessions import Scene
from sessions.synthetic.rng import random_stream
from sessions.synthetic.tracker import VIVE, TrackerNoise

DEFAULT_COPIES: Final = 64
"""Of 64 copies 61 are the share of 0.95 from which a contact holds, and 3 that up to which it is absent."""

MOST_COPIES: Final = 100_000

_QUANTITY_PATTERN = re.compile(r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(um|mm|cm|m|deg|rad|ms|s)\s*")
_UNITS: Final = {
    "um": ("position_rms_m", 1e-6),
    "mm": ("position_rms_m", 1e-3),
    "cm": ("position_rms_m", 1e-2),
    "m": ("position_rms_m", 1.0),
    "deg": ("rotation_rms_deg", 1.0),
    "rad": ("rotation_rms_deg", 180.0 / np.pi),
    "ms": ("correlation_s", 1e-3),
    "s": ("correlation_s", 1.0),
}
UPPER_LIMITS: Final = {"position_rms_m": 1e3, "rotation_rms_deg": 360.0, "correlation_s": 86_400.0}
"""No tracker is worse; numbers that overflow when they are drawn are refused with these."""
_NOISE_SYNTAX: Final = 'write vive or "0.3 mm, 0.05 deg, 0.1 s", or one of them for a body: beaker=vive'


@dataclass(frozen=True)
class NoiseSpec:
    """The noise asked for: ``usual`` of all trackers but those that ``noise_of_body`` names; ``copies`` are drawn."""

    copies: int
    usual: TrackerNoise | None
    noise_of_body: Mapping[str, TrackerNoise]


def parse_noise(texts: Sequence[str], copies: int = DEFAULT_COPIES) -> NoiseSpec | None:
    """Read ``[BODY=]vive`` or ``[BODY=]0.3 mm, 0.05 deg, 0.1 s``; ``None`` of no words.

    Sizes are root mean squares: of the length of the position error and of the angle of the rotation error; the time is
    that in which the correlation falls by 1/e. What is left out is that of ``vive``. Raises ``NoiseError``.

    Examples
    --------
    >>> parse_noise(["0.3 mm, 0.05 deg, 0.1 s"]).usual.rotation_rms_deg
    0.05
    """
    if not 1 <= copies <= MOST_COPIES:
        raise NoiseError(f"{copies} noisy copies cannot be drawn; give 1 to {MOST_COPIES}")
    noise_of_body: dict[str, TrackerNoise] = {}
    for body_noise_text in texts:
        body, _, noise_text = body_noise_text.rpartition("=")
        noise_of_body[body.strip()] = _tracker_noise(noise_text)
    return NoiseSpec(copies, noise_of_body.pop("", None), noise_of_body) if texts else None


def _tracker_noise(noise_text: str) -> TrackerNoise:
    if noise_text.strip() == "vive":
        return VIVE
    sizes: dict[str, Any] = {}
    for term in noise_text.split(","):
        term_match = _QUANTITY_PATTERN.fullmatch(term)
        name, unit = _UNITS[term_match[2]] if term_match else ("", 0.0)
        value = float(term_match[1]) * unit if term_match else 0.0
        if not name or name in sizes or value > UPPER_LIMITS[name] or (name == "correlation_s" and not value):
            raise NoiseError(f"{noise_text!r} is no noise; {_NOISE_SYNTAX}")
        sizes[name] = value
    return TrackerNoise(**sizes)


@dataclass(frozen=True, eq=False)
class BodyNoise:
    """The noise of the bodies of an assembly.

    Parameters
    ----------
    roots : of each of N bodies the tracker that carries it: a name.
    anchors : of each body the number of the body that is its tracker, or its own.
    noise : root -> its noise; a root that is missing has none.
    """

    roots: tuple[str, ...]
    anchors: tuple[int, ...]
    noise: Mapping[str, TrackerNoise]

    def reach(self, pair_bodies: Sequence[int], lever_lengths: Sequence[float]) -> float:
        """Metres by which the noise may move two bodies against each other: five sigma; 0 where one tracker has both.

        ``lever_lengths``: metres of a surface from the origin of each body.
        """
        first_root, second_root = (self.roots[body] for body in pair_bodies)
        if first_root == second_root:
            return 0.0
        sizes = [self.noise.get(root) for root in (first_root, second_root)]
        error_bounds = [
            size.margin(lever, bodies=1) for size, lever in zip(sizes, lever_lengths, strict=True) if size is not None
        ]
        return float(np.linalg.norm(error_bounds))


def noise_of(spec: NoiseSpec, assembly: Assembly, scene: Scene) -> BodyNoise:
    """The noise of every tracker of an assembly.

    Bodies that one tracker carries share its error. What the scene fixes has none. Raises ``NoiseError``: a body that
    is not there.
    """
    body_names = assembly.names
    roots = tuple(chain_of(name, scene)[-1] for name in body_names)
    unknown_bodies = [name for name in spec.noise_of_body if name not in {*body_names, *roots}]
    if unknown_bodies:
        raise NoiseError(f"there is no body {unknown_bodies[0]!r} to be noisy; there are: {', '.join(body_names)}")
    fixed_bodies = {body.id for body in scene.bodies if body.fixed is not None}
    usual_noise = {root: spec.usual for root in roots if root not in fixed_bodies}
    sizes = {**usual_noise, **{root: spec.noise_of_body[root] for root in roots if root in spec.noise_of_body}}
    anchors = tuple(body_names.index(root) if root in body_names else body for body, root in enumerate(roots))
    return BodyNoise(roots, anchors, {root: size for root, size in sizes.items() if size is not None})


class NoisyCopies:
    """Errors of every tracker in every copy, block after block of one recording.

    They are the same whatever the size of the blocks, and whichever other bodies there are: each tracker has a random
    stream of its own, and errors of two frames correlate by their true distance in time.
    """

    def __init__(self, noise: BodyNoise, copies: int, seed: int) -> None:
        self.noise, self.copies = noise, copies
        self._streams = {root: random_stream(seed, "noisy copies", root) for root in noise.noise}
        self._last_errors = {root: np.zeros((copies, 6)) for root in noise.noise}
        self._last_time = -np.inf

    def errors(self, times: FloatArray) -> dict[str, FloatArray]:
        """Root -> its errors (B, C, 6) at the frames of a block: of the place in metres, a rotation vector in radians.

        Source: an Ornstein-Uhlenbeck process, stepped exactly.
        """
        gaps = np.diff(times, prepend=self._last_time)
        self._last_time = float(times[-1])
        errors_of_root = {}
        for root, noise in self.noise.noise.items():
            correlation = np.exp(-gaps / noise.correlation_s)
            series = self._streams[root].standard_normal((len(times), self.copies, 6))
            series *= np.sqrt(1.0 - correlation**2)[:, None, None]
            last_errors = self._last_errors[root]
            for row, fraction in enumerate(correlation.tolist()):
                last_errors = np.add(series[row], fraction * last_errors, out=series[row])
            self._last_errors[root] = last_errors.copy()
            standard_deviations = noise.position_rms_m, np.radians(noise.rotation_rms_deg)
            errors_of_root[root] = series * np.repeat(standard_deviations, 3) / np.sqrt(3.0)
        return errors_of_root

    def poses(
        self, motion: Motion, errors: Mapping[str, FloatArray], body: int, is_row: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """Rotations (C k, 3, 3) and places (C k, 3) of a body at k rows of a block, copy after copy."""
        rotations, translation = motion.rotations[is_row, body], motion.translations[is_row, body]
        body_errors = errors.get(self.noise.roots[body])
        if body_errors is None:
            return np.tile(rotations, (self.copies, 1, 1)), np.tile(translation, (self.copies, 1))
        translation_errors, rotation_errors = np.split(body_errors[is_row].swapaxes(0, 1), 2, axis=2)
        rotation = (
            Rotation.from_rotvec(rotation_errors.reshape(-1, 3)).as_matrix().reshape(*translation_errors.shape, 3)
        )
        if self.noise.anchors[body] != body:
            lever = translation - motion.translations[is_row, self.noise.anchors[body]]
            translation_errors = translation_errors + (rotation @ lever[None, :, :, None])[..., 0] - lever
        return (rotation @ rotations).reshape(-1, 3, 3), (translation + translation_errors).reshape(-1, 3)
