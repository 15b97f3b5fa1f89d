"""The recording for Rerun: every fixture its faces that meet in red, and a tab per table with picture and cells."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from cdcore.numerics import place_points
from replay.outputs.rerun_log.recording_file import recording_file
from replay.outputs.tables import markdown

if TYPE_CHECKING:
    from replay.studies.paper.experiment import PaperResult

RED: Final = (220, 40, 40)
TIMELINE: Final = "faces_that_intersect"


def record(result: PaperResult, pictures: Mapping[str, tuple[str, bytes]], path: Path) -> None:
    """Write the recording. ``pictures``: key of a table -> file name and PNG."""
    with recording_file("vrlab-replay paper", path, _blueprint(result)) as recording:
        _log_fixtures(recording, result)
        _log_accuracy(recording, result)
        for one in result.tables:
            name = entity_of(one.key)
            words = rr.TextDocument(markdown(one.plain, level=1), media_type=rr.MediaType.MARKDOWN)
            recording.log(["tables", name], words, static=True)
            if one.key in pictures:
                image = rr.EncodedImage(contents=pictures[one.key][1], media_type="image/png")
                recording.log(["pictures", name], image, static=True)


def entity_of(key: str) -> str:
    """The key of a table as part of an entity path."""
    return key.lower().replace(" ", "_")


def _blueprint(result: PaperResult) -> Any:
    families = sorted({group.family for group in result.groups})
    shapes = [rrb.Spatial3DView(origin=f"/fixtures/{family}", name=family) for family in families]
    curve = rrb.TimeSeriesView(origin="/accuracy", name="accuracy by faces that intersect")
    tabs = [rrb.Vertical(rrb.Horizontal(*shapes), curve, row_shares=[3, 2], name="Fixtures")]
    for one in result.tables:
        name = entity_of(one.key)
        picture = rrb.Spatial2DView(origin=f"/pictures/{name}", name=one.title)
        cells = rrb.TextDocumentView(origin=f"/tables/{name}", name="cells")
        tabs.append(rrb.Vertical(picture, cells, name=one.key))
    time = rrb.TimePanel(timeline=TIMELINE, state="collapsed")
    return rrb.Blueprint(rrb.Tabs(*tabs), time, rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden"))


def _log_fixtures(recording: rr.RecordingStream, result: PaperResult) -> None:
    """The first pose of each column, the faces that meet in red."""
    for group in result.groups:
        recording.set_time(TIMELINE, sequence=group.target)
        for body, thing in enumerate(group.bodies):
            turn, place = group.motion.rotations[0, body], group.motion.translations[0, body]
            points = place_points(thing.mesh.vertices, turn, place)
            where: list[object] = ["fixtures", group.family, thing.name]
            recording.log(where, rr.Mesh3D(vertex_positions=points, triangle_indices=thing.mesh.faces))
            red = thing.mesh.faces[np.unique(group.truth[0][:, body])]
            mesh = rr.Mesh3D(vertex_positions=points, triangle_indices=red, albedo_factor=RED)
            recording.log([*where, "faces that meet"], mesh)


def _log_accuracy(recording: rr.RecordingStream, result: PaperResult) -> None:
    """Mean face recall of each column at each budget."""
    for share, answers in result.table_one.equal.items():
        for name, row in answers.items():
            for target in result.experiment["targets"]:
                recalls = [one.face_recall for one in row if one.target == target]
                recording.set_time(TIMELINE, sequence=target)
                recording.log(["accuracy", f"B {share:g}", name], rr.Scalars(float(np.mean(recalls))))
