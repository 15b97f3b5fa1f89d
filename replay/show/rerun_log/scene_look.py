"""The same look at an import in Rerun: bodies that move as recorded, their names, a grid of 10 cm, and axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final
from uuid import uuid4

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from replay.prepare.assembly import Assembly
from replay.show.palette import SERIES_COLOURS, TICKS
from replay.show.rerun_log.recording_file import RecordingClock, RecordingWriter, pack_colours, recording_file
from replay.show.rerun_log.scene import body_path, log_world
from replay.show.scene_look import AXIS_COLOURS, AXIS_NAMES, Moment, grid_and_axes
from sessions.model.scene import Scene

GRID_RADIUS_M: Final = 0.0005
AXIS_RADIUS_M: Final = 0.004
"""Radii of lines, metres."""


def write_scene_recording(assembly: Assembly, scene: Scene, moments: Sequence[Moment], path: Path) -> None:
    """Writes a Rerun recording of a whole import; ``OSError`` where it cannot be written."""
    clock = RecordingClock.of(assembly, [moment.frame for moment in moments])
    view = rrb.Spatial3DView(origin="/", name="Is this your scene?")
    blueprint = rrb.Blueprint(view, rrb.TimePanel(timeline="session", state="expanded"))
    with recording_file(f"vrlab-replay-look-{uuid4().hex}", path, blueprint) as stream:
        writer = RecordingWriter(stream, clock)
        names = [body.name for body in assembly.bodies]
        colours = {name: [(0, 0, SERIES_COLOURS[number % len(SERIES_COLOURS)])] for number, name in enumerate(names)}
        log_world(writer, assembly, scene, names, colours)
        for body in assembly.bodies:
            mesh_middle = body.mesh.vertices.mean(axis=0)[None]
            writer.static(f"{body_path(body.name)}/name", rr.Points3D(mesh_middle, labels=[body.name], radii=0.001))
        guides = grid_and_axes(assembly, moments[0].frame)
        grid = rr.LineStrips3D([*guides.grid], colors=pack_colours([TICKS]), radii=GRID_RADIUS_M)
        writer.static("grid", grid)
        directions = np.diff(guides.axes, axis=1)[:, 0]
        arrows = rr.Arrows3D(
            origins=guides.axes[:, 0],
            vectors=directions,
            colors=pack_colours(AXIS_COLOURS),
            labels=[*AXIS_NAMES],
            radii=AXIS_RADIUS_M,
        )
        writer.static("axes", arrows)
