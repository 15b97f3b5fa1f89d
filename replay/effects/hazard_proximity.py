"""Seconds and least distance of a head or hand near a hazard; far away it costs one distance a frame."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.effects.declaring import Declaration, bodies, body, number
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Series
from replay.effects.protocol import EffectSpec
from replay.effects.spans import Span, switched
from sessions.mesh_data import MeshData

FRAMES_AT_ONCE: Final = 64
"""Frames whose vertices are placed together: 3,000 vertices in 5 MB, which a cache holds."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``near`` with their end, seconds and least distance; the distance as a series where it was computed."""
    found = Findings(len(inputs))
    for declared in inputs.declared:
        hazard = declared.body("hazard")
        for visitor in declared.bodies("of"):
            if visitor == hazard:
                continue
            distance = _distance(inputs, declared, visitor, hazard)
            rows = np.flatnonzero(np.isfinite(distance))
            found.ran[rows] = True
            spans = _near(distance, declared)
            found.events += [_event(inputs, visitor, hazard, distance, span) for span in spans]
            name = f"{visitor}-{hazard}"
            if len(rows):
                found.series[f"{name}/distance"] = Series(inputs.times[rows], distance[rows], "m")
            if spans:
                found.lanes[name] = inputs.shown(spans, "near")
    return found.output()


def _distance(inputs: EffectInputs, declared: Declaration, visitor: str, hazard: str) -> FloatArray:
    """Distance (T,) of the visitor's vertices to the hazard's box; NaN where its ball is too far to matter."""
    comer, danger = inputs.poses(visitor), inputs.poses(hazard)
    relative = comer.relative_to(danger)
    box = _corners(inputs.mesh(hazard))
    low, high = box.min(axis=0), box.max(axis=0)
    high = high + np.array([0.0, declared.number("above"), 0.0])
    vertices = _corners(inputs.mesh(visitor))
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    radius = float(np.sqrt(((vertices - middle) ** 2).sum(axis=1)).max())
    centre = relative.point(middle)
    away = np.maximum(0.0, np.maximum(low - centre, centre - high))
    gate = np.sqrt((away * away).sum(axis=-1)) - radius <= declared.number("distance") + declared.number("leave_by")
    rows = np.flatnonzero(gate & relative.valid)
    inputs.count("ball tests", int(relative.valid.sum()))
    inputs.count("vertex tests", len(rows) * len(vertices))
    distance = np.full(len(inputs), np.nan)
    for start in range(0, len(rows), FRAMES_AT_ONCE):
        part = rows[start : start + FRAMES_AT_ONCE]
        distance[part] = _nearest(relative, part, vertices, low, high)
    return distance


def _nearest(
    relative: BodyPoses, rows: NDArray[np.int64], vertices: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    places = relative.rotation[rows] @ vertices.T
    square = np.zeros(places[:, 0].shape)
    for axis in range(3):
        along = places[:, axis] + relative.translation[rows, axis, None]
        along -= np.clip(along, low[axis], high[axis])
        along *= along
        square += along
    return np.asarray(np.sqrt(square.min(axis=1)))


def _near(distance: FloatArray, declared: Declaration) -> list[Span]:
    """Where the distance is below the declared one, until it is ``leave_by`` above; beyond the gate it is far."""
    enter, leave = declared.number("distance"), declared.number("distance") + declared.number("leave_by")
    return switched(-np.where(np.isnan(distance), np.inf, distance), -enter, -leave)


def _event(inputs: EffectInputs, visitor: str, hazard: str, distance: FloatArray, span: Span) -> EffectEvent:
    start, last = inputs.ends(span)
    least = float(np.nanmin(distance[slice(*span)]))
    values = {"seconds": last - start, "least_m": least}
    words = f"{visitor} within {least * 1e3:.0f} mm of {hazard} for {last - start:.1f} s"
    return EffectEvent(start, "near", (visitor, hazard), inputs.end(span[1]), values, words, "warning")


def _corners(mesh: MeshData) -> FloatArray:
    return np.asarray(mesh.vertices, dtype=np.float64)[np.unique(np.asarray(mesh.faces))]


OURS: Final = "chosen by us: five times the noise of a VIVE tracker (2 mm), so that standing at the border is one event"

SPEC = EffectSpec(
    kind="hazard-proximity",
    about="A head or hand comes near a hazard.",
    compute=compute,
    fields={
        "of": bodies("heads and hands"),
        "hazard": body("the hazard; its volume is the box about its mesh, in its own frame"),
        "distance": number("nearer than this counts as near", "m", above=0.0),
        "above": number(
            "height added to the volume, as of a flame that has no mesh", "m", default=0.0, least=0.0,
            source="none added unless the scene's author does",
        ),
        "leave_by": number("further than distance by this it is left", "m", default=0.01, least=0.0, source=OURS),
    },
    trigger="the ball about the visitor within the distance of the hazard's box",
    sources=("distance: the scene's author", OURS),
)  # fmt: skip
