"""One audited detector in the picture: its entities, its words, and which of its lanes stand beside the picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

LANES_IN_VIEW: Final = 7
"""Lanes beside the picture, the numbers included: at 40 points each, more would be cut off. All are in the next tab."""


@dataclass(frozen=True)
class Subject:
    """Entities and words of one audited detector.

    Parameters
    ----------
    label : its name; ``headline`` says what it missed.
    lanes : paths of its lanes and the pair's column each speaks of, numbers (``None``) first.
    longest : column of the pair of the longest cut that was missed, ``None`` without a miss.
    listing, worst, note : list of misses, table of the worst, words on the current one.
    clusters : list of clusters, ``""`` where the misses are few enough to be read one by one.
    missed : root of pins and flags; ``faces`` names its red faces below each body, ``face_entities`` are their paths.
    camera : entity whose pose is the close-up of the current miss, ``""`` when nothing was missed.
    """

    label: str
    headline: str
    lanes: Mapping[str, int | None]
    longest: int | None
    listing: str
    clusters: str
    worst: str
    note: str
    missed: str
    faces: str
    face_entities: tuple[str, ...]
    camera: str


def lanes_in_view(subject: Subject) -> list[str]:
    """The numbers, the worst pairs, and the pair of the longest cut, on which the cursor stands first."""
    lanes = list(subject.lanes)
    shown = lanes[:LANES_IN_VIEW]
    worst = [lane for lane in lanes[LANES_IN_VIEW:] if subject.lanes[lane] == subject.longest]
    return [*shown[: LANES_IN_VIEW - len(worst)], *worst]
