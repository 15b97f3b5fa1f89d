"""Views that more than one tab has, and the layout around all tabs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from replay.outputs.camera import Eye
from replay.outputs.palette import BACKGROUND
from replay.outputs.rerun_log.columns import FRAME, SESSION, drawable

PLAIN: Final = rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor)


def whole_layout(tabs: Sequence[Any], first: int = 0) -> rrb.Blueprint:
    """All tabs, the first to be seen by its number; nothing else is on screen, and nothing moves."""
    times = rrb.TimePanel(timeline=SESSION, state="collapsed", playback_speed=0.25, play_state="paused")
    hidden = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden")
    return rrb.Blueprint(rrb.Tabs(*tabs, active_tab=first), times, *hidden, auto_views=False, auto_layout=False)


def seconds_between(start: float, end: float) -> rrb.TimeAxis:
    """These seconds, from side to side; zooming stays possible."""
    ends = (rr.TimeRangeBoundary.absolute(seconds=at) for at in (start, end))
    return rrb.TimeAxis(view_range=rr.TimeRange(*ends))


def spatial(name: str, contents: Sequence[str], eye: Eye | str, origin: str = "/world") -> Any:
    """A room, dark and without a grid; ``eye``: where it is seen from first, or the entity that the view follows."""
    controls = rrb.EyeControls3D(tracking_entity=f"/{eye}") if isinstance(eye, str) else _orbit(eye)
    return rrb.Spatial3DView(
        origin=origin, contents=list(contents), name=drawable(name), eye_controls=controls, background=PLAIN,
        line_grid=rrb.LineGrid3D(visible=False),
    )  # fmt: skip


def _orbit(eye: Eye) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=eye.position, look_target=eye.target, eye_up=(0.0, 1.0, 0.0)
    )


def text_view(path: str, name: str) -> Any:
    """One text."""
    return rrb.TextDocumentView(origin=f"/{path}", name=drawable(name))


def text_list(path: str, name: str, *more: str) -> Any:
    """Lines of which a click moves the cursor, of one entity or of several."""
    times = [TimelineColumn(SESSION), TimelineColumn(FRAME, visible=False)]
    columns = rrb.TextLogColumns(timeline_columns=times, text_log_columns=[TextLogColumn("body")])
    one_width = rrb.TextLogFormat(monospace_body=True)
    contents = [f"/{one}" for one in (path, *more)]
    return rrb.TextLogView(
        origin=f"/{path}", contents=contents, name=drawable(name), columns=columns, format_options=one_width
    )


def flat(path: str, name: str, x_range: tuple[float, float], y_range: tuple[float, float]) -> Any:
    """A view drawn by hand, y downwards, over these ranges."""
    bounds = rrb.VisualBounds2D(x_range=x_range, y_range=y_range)
    return rrb.Spatial2DView(origin=f"/{path}", name=drawable(name), visual_bounds=bounds, background=PLAIN)


def plot(axis: rrb.TimeAxis, origin: str, name: str, paths: Iterable[str] = (), **more: Any) -> Any:
    """Curves over time: of these entities, or of all below the origin."""
    contents = [f"/{path}" for path in paths] or "$origin/**"
    legend = rrb.PlotLegend(rrb.Corner2D.RightTop)
    return rrb.TimeSeriesView(
        origin=origin, name=drawable(name), axis_x=axis, plot_legend=legend, contents=contents, **more
    )


def state_view(root: str, name: str, times: rrb.TimeAxis, lanes: Sequence[str] = ("**",)) -> Any:
    """A view of lanes, of all below a root if none is named."""
    contents = [f"/{root}/**" if lane == "**" else f"/{lane}" for lane in lanes]
    return rrb.StateTimelineView(origin=f"/{root}", contents=contents, name=drawable(name), time_view=times)
