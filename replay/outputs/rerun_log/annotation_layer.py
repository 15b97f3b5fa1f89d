"""Annotations as a layer over the picture of a run: a recording of its own, which the viewer opens beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import rerun as rr
from rerun.chunk import RrdReader

from replay.outputs.rerun_log.focus import read_static
from replay.outputs.rerun_log.markdown import markdown
from replay.outputs.rerun_log.recording_file import read_all
from replay.outputs.results.annotations import annotation_table, read_annotations
from replay.outputs.results.run_folder import RunFolder

REPORT: Final = "report"


def write_layer(run: RunFolder, path: Path) -> bool:
    """Write the text of the picture's report anew, the annotations at its head; whether there are any."""
    said = read_annotations(run.path)
    if not said:
        return False
    (store,) = RrdReader(run.picture).recordings()
    (text,) = read_static(run.picture, REPORT)["text"]
    words = f"{markdown(annotation_table(run, said), level=2)}\n\n{text}"
    stream = rr.RecordingStream(store.application_id, recording_id=store.recording_id)
    encoded = rr.binary_stream(recording=stream)
    stream.log(REPORT, rr.TextDocument(words, media_type=rr.MediaType.MARKDOWN), static=True)
    path.write_bytes(read_all(encoded))
    stream.disconnect()
    return True
