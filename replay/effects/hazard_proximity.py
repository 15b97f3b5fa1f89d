"""Seconds and least distance of a head or hand near a hazard; far away it costs one distance a frame."""

from typing import Final

import numpy as np

from replay import words
from replay.effects.declaring import Declaration
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Series
from replay.effects.protocol import spec_of
from replay.effects.spans import FrameRange, hysteresis_spans
from sessions.mesh_data import MeshData

FRAMES_AT_ONCE: Final = 64
"""Frames that are looked at together: their distances to the points of a hand stay in a processor's cache. With 256
the flame test takes four times as long (2026-11-23)."""

EDGE_STEP_M: Final = 0.02
MOST_EDGE_PIECES: Final = 40
"""Of an edge: a board of a metre then has a point every 25 mm, and costs some thousand points a frame."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``near`` with their end, seconds and least distance; the distance as a series where it was computed."""
    findings = Findings(len(inputs))
    for declared in inputs.declared:
        hazard = declared["hazard"]
        for visitor in declared["of"]:
            if visitor == hazard:
                continue
            distance = _distance_to_hazard(inputs, declared, visitor, hazard)
            rows = np.flatnonzero(np.isfinite(distance))
            findings.ran[rows] = True
            release_distance = declared["distance"] + declared["leave_by"]
            # Beyond the gate it is far.
            spans = hysteresis_spans(
                -np.where(np.isnan(distance), np.inf, distance), -declared["distance"], -release_distance
            )
            findings.events += [_near_event(inputs, visitor, hazard, distance, span) for span in spans]
            name = f"{visitor}-{hazard}"
            if len(rows):
                findings.series[f"{name}/distance"] = Series(inputs.times[rows], distance[rows], "m")
            if spans:
                findings.lanes[name] = inputs.lane_spans(spans, "near")
    return findings.output()


def _distance_to_hazard(inputs: EffectInputs, declared: Declaration, visitor: str, hazard: str) -> FloatArray:
    """Distance (T,) of the visitor's surface to the hazard's box; NaN where its ball is too far to matter."""
    visitor_poses, hazard_poses = inputs.poses(visitor), inputs.poses(hazard)
    valid = visitor_poses.valid & hazard_poses.valid
    mesh = inputs.mesh(hazard)
    box = mesh.vertices[np.unique(mesh.faces)]
    lower, upper = box.min(axis=0), box.max(axis=0)
    upper = upper + np.array([0.0, declared["above"], 0.0])
    vertices = surface_points(inputs.mesh(visitor))
    ball_centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    radius = float(np.linalg.norm(vertices - ball_centre, axis=1).max())
    centre = hazard_poses.to_body_frame(visitor_poses.point(ball_centre))
    box_offsets = np.maximum(0.0, np.maximum(lower - centre, centre - upper))
    is_near_enough = np.linalg.norm(box_offsets, axis=1) - radius <= declared["distance"] + declared["leave_by"]
    rows = np.flatnonzero(is_near_enough & valid)
    inputs.count("vertex tests", len(rows) * len(vertices))
    distance = np.full(len(inputs), np.nan)
    for start in range(0, len(rows), FRAMES_AT_ONCE):
        frames_of_block = rows[start : start + FRAMES_AT_ONCE]
        relative_poses = visitor_poses.take(frames_of_block).relative_to(hazard_poses.take(frames_of_block))
        distance[frames_of_block] = np.sqrt(_square_to_box(vertices, relative_poses, lower, upper).min(axis=0))
    return distance


def _square_to_box(points: FloatArray, relative: BodyPoses, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Squared distance (m, n) of points (m, 3) of the visitor in n frames; by plain products axis by axis."""
    box_middle, half_size = 0.5 * (lower + upper), 0.5 * (upper - lower)
    squared_distances = np.zeros((len(points), len(relative.times)))
    for axis in range(3):
        axis_distances = points @ relative.rotation[:, axis].T
        axis_distances += relative.translation[:, axis] - box_middle[axis]
        np.abs(axis_distances, out=axis_distances)
        axis_distances -= half_size[axis]
        np.maximum(axis_distances, 0.0, out=axis_distances)
        axis_distances *= axis_distances
        squared_distances += axis_distances
    return squared_distances


def _near_event(inputs: EffectInputs, visitor: str, hazard: str, distance: FloatArray, span: FrameRange) -> EffectEvent:
    start, last = inputs.span_times(span)
    least_distance = float(np.nanmin(distance[slice(*span)]))
    event_values = {"seconds": last - start, "least_m": least_distance}
    message = (
        f"{visitor} comes within {words.decimal(least_distance * 1e3, 0)} mm of {hazard} for "
        f"{words.decimal(last - start, 1)} s"
    )
    return EffectEvent(start, "near", (visitor, hazard), inputs.end(span[1]), event_values, message, "warning")


def surface_points(mesh: MeshData) -> FloatArray:
    """Vertices (n, 3), and points in large faces ``EDGE_STEP_M`` apart: a board has vertices at its corners alone.

    What lies between them is nearer by less than a step.
    """
    faces = mesh.vertices[mesh.faces]
    longest = np.linalg.norm(faces - np.roll(faces, 1, axis=1), axis=2).max(axis=1)
    pieces = np.minimum(np.ceil(longest / EDGE_STEP_M), MOST_EDGE_PIECES).astype(np.int64)
    points_on_edges = [mesh.vertices[np.unique(mesh.faces)]]
    for count in np.unique(pieces[pieces > 1]).tolist():
        weights = np.array([(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)]) / count
        points_on_edges.append((weights @ faces[pieces == count]).reshape(-1, 3))
    points = np.concatenate(points_on_edges).round(9)
    # Only faces that share an edge give a point twice; a hand of small faces has none to look for.
    return points if len(points_on_edges) == 1 else np.unique(points, axis=0)


SPEC = spec_of("hazard-proximity", compute)
