"""What is laid out: the run, its audited detectors, and what the views of several tabs have in common."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import rerun.blueprint as rrb

from replay.outputs.camera import Eye
from replay.outputs.lanes import number_boxes
from replay.outputs.rerun_log.contacts import contacts_path
from replay.outputs.rerun_log.lanes import noise_lane
from replay.outputs.rerun_log.overview import SPACE, OverviewLanes
from replay.outputs.rerun_log.pipeline import sphere_path
from replay.outputs.rerun_log.solids import solid_path, with_solids
from replay.outputs.rerun_log.timing import Cost, cost_of
from replay.outputs.rerun_log.views import faded_meshes, seconds_between
from replay.outputs.watched_run import WatchedRun
from replay.pipeline.run_result import RunResult

LANE_POINTS: Final = 40
RULER_POINTS: Final = 64
"""Heights of a lane, and of title and ruler together, in points: the viewer does not let us choose."""

LOW_POINTS: Final = 704
"""Height the tabs share on a screen of 800 lines: shares are relative, so what is whole there is whole on all."""

LANES_IN_VIEW: Final = 5
"""Lanes beside the picture, the numbers included: at 40 points each, more would be cut off. All are in the next tab."""


@dataclass(frozen=True)
class Subject:
    """Entities and words of one audited detector; ``headline`` says what it missed."""

    label: str
    headline: str
    lanes: Mapping[str, int | None]  # paths of its lanes and the pair's column each speaks of, numbers (``None``) first
    longest: int | None  # column of the pair of the longest cut that was missed, ``None`` without a miss
    words: str  # root of its lists: of misses, of clusters where they are ``many``, words on the current one
    many: bool
    missed: str  # root of pins and flags, and of the eye of the close-up
    faces: str  # its red faces below each body

    @property
    def camera(self) -> str:
        """Entity whose pose is the close-up of the current miss, ``""`` when nothing was missed."""
        return "" if self.longest is None else f"{self.missed}/eye"


def lanes_in_view(subject: Subject, noisy: bool = False) -> list[str]:
    """The numbers, the worst pairs, and the pair of the longest cut, on which the cursor stands first.

    ``noisy``: below each pair what tracker noise leaves of its contacts; there is room for half as many pairs then.
    """
    lanes, room = list(subject.lanes), 1 + (LANES_IN_VIEW - 1) // (1 + noisy)
    worst = [lane for lane in lanes[room:] if subject.lanes[lane] == subject.longest]
    chosen = [*lanes[: room - len(worst)], *worst]
    return [path for lane in chosen for path in (lane, noise_lane(lane))[: 1 + (noisy and lane != lanes[0])]]


@dataclass(frozen=True)
class BlueprintInput:
    """What is laid out."""

    result: RunResult
    subjects: Sequence[Subject]
    eye: Eye  # of the overview
    detector_lanes: bool  # whether there are lanes per detector
    watched: Sequence[WatchedRun] = ()  # audited detectors that are shown at their work
    overview: OverviewLanes | None = None  # lanes of the screen of all detectors, ``None`` without a moment to show
    hiding: Collection[str] = ()  # bodies that stand before what a close-up shows: translucent there

    @cached_property
    def costs(self) -> dict[str, Cost]:
        """Label -> what the detector took."""
        return {label: cost_of(detection) for label, detection in self.result.detections.items()}

    @cached_property
    def solids(self) -> dict[str, list[str]]:
        """Label -> entities of the solids in place of the meshes."""
        bodies = self.result.assembly.names
        return {label: [solid_path(body, label) for body in bodies] for label in with_solids(self.result)}

    @cached_property
    def whole(self) -> rrb.TimeAxis:
        """The whole session; left alone, the viewer shows one minute around the cursor."""
        times = self.result.assembly.motion.times
        start, last = (float(times[0]), float(times[-1])) if len(times) else (0.0, 1.0)
        # The last number may be widened beyond the last frame.
        boxes = [box for misses in self.result.misses.values() for box in number_boxes(misses, round(last * 1e9))]
        return seconds_between(start, max([last, *(end / 1e9 for _, _, end in boxes)]))

    @cached_property
    def faded(self) -> dict[str, Any]:
        """Overrides of a close-up."""
        return faded_meshes(self.result, self.hiding)

    @cached_property
    def crowding(self) -> list[str]:
        """Rules that keep out of a view what would hide what it stands on: contact normals and bounding spheres."""
        spheres = [sphere_path(body, run.label) for run in self.watched for body in self.result.assembly.names]
        return [f"- /{path}" for path in [*(f"{contacts_path(label)}/normals" for label in self.costs), *spheres]]

    @property
    def hidden(self) -> list[str]:
        """The same, without solids and what belongs to the moment in focus."""
        solids = [path for paths in self.solids.values() for path in paths]
        return [*self.crowding, *(f"- /{path}" for path in [*solids, f"{SPACE}/**"])]
