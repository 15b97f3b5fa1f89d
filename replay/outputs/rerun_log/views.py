"""Views that more than one tab has."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from replay.outputs.materials import albedo, tags_of
from replay.outputs.palette import BACKGROUND
from replay.outputs.rerun_log.columns import FRAME, SESSION
from replay.outputs.rerun_log.world import body_path
from replay.pipeline.run_result import RunResult

PLAIN: Final = rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor)


FADED: Final = 110
"""Alpha, at most, of a body that stands before the point of a picture."""

GROUND: Final = ("bench", "table", "furniture")
"""Tags of what stays solid."""


def faded_meshes(result: RunResult, names: Collection[str]) -> dict[str, Any]:
    """Overrides of a view in which these bodies are translucent; the ground stays solid."""
    # A body that has no pose for a while is hidden by its own colour, which must stay.
    always: Any = result.assembly.motion.valid.all(axis=0)
    found = {}
    for name, seen in zip(result.assembly.names, always, strict=True):
        tags = tags_of(name, result.session.scene)
        if name in names and seen and not set(tags) & set(GROUND):
            *colour, alpha = albedo(tags)
            found[f"/{body_path(name)}/mesh"] = rr.Mesh3D.from_fields(albedo_factor=(*colour, min(alpha, FADED)))
    return found


def spatial(name: str, contents: Sequence[str], controls: rrb.EyeControls3D, **more: Any) -> Any:
    """The room, dark and without a grid."""
    return rrb.Spatial3DView(
        origin="/world", contents=list(contents), name=name, eye_controls=controls, background=PLAIN,
        line_grid=rrb.LineGrid3D(visible=False), **more,
    )  # fmt: skip


def text_list(path: str, name: str, *more: str) -> Any:
    """Lines of which a click moves the cursor, of one entity or of several."""
    times = [TimelineColumn(SESSION), TimelineColumn(FRAME, visible=False)]
    columns = rrb.TextLogColumns(timeline_columns=times, text_log_columns=[TextLogColumn("body")])
    one_width = rrb.TextLogFormat(monospace_body=True)
    contents = [f"/{one}" for one in (path, *more)]
    return rrb.TextLogView(origin=f"/{path}", contents=contents, name=name, columns=columns, format_options=one_width)


def plot(axis: rrb.TimeAxis, origin: str, name: str, paths: Iterable[str] = (), **more: Any) -> Any:
    """Curves over time: of these entities, or of all below the origin."""
    contents = [f"/{path}" for path in paths] or "$origin/**"
    legend = rrb.PlotLegend(rrb.Corner2D.LeftTop)
    return rrb.TimeSeriesView(origin=origin, name=name, axis_x=axis, plot_legend=legend, contents=contents, **more)
