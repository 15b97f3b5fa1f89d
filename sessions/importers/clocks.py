"""Where two clocks of a recording meet: offset and drift between them, and how far the readings are from that line."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class ClockFit:
    """``offset`` seconds at the mean of the readings, ``drift`` seconds a second, ``residual`` the largest miss."""

    readings: int
    middle: float
    offset: float
    drift: float
    residual: float

    @classmethod
    def of(cls, at: ArrayLike, ahead: ArrayLike) -> "ClockFit":
        """By least squares: at seconds ``at`` (n,) of one clock the other shows ``ahead`` (n,) seconds more."""
        times, values = np.asarray(at, dtype=np.float64), np.asarray(ahead, dtype=np.float64)
        middle = float(times.mean())
        spread = bool(np.ptp(times) > 0.0)
        drift, offset = np.polyfit(times - middle, values, 1) if spread else (0.0, values.mean())
        residual = np.abs(values - offset - drift * (times - middle)).max()
        return cls(len(times), middle, float(offset), float(drift), float(residual))

    def ahead(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the other clock shows more, (n,) seconds."""
        return self.offset + self.drift * (at - self.middle)

    @property
    def words(self) -> str:
        """Offset, drift and residual for a reader."""
        return (
            f"{self.offset * 1e3:.3f} ms, drift {self.drift * 1e6:.1f} ppm, "
            f"at most {self.residual * 1e3:.3f} ms from a line"
        )
