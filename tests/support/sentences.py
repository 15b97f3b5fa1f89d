"""Every text of a recording, read back from its file."""

from rerun.chunk import RrdReader

from replay.outputs.rerun_log.recording import write_recording


def picture_text(result, path):
    """Every text of the recording of a run, of its layout too, read back from the file."""
    write_recording(result, path)
    return recording_text(path)


def recording_text(path):
    """Every text of a recording, of its layout too."""
    reader = RrdReader(path)
    found = []
    for store in (*reader.blueprints(), *reader.recordings()):
        for chunk in reader.stream(store=store).to_chunks():
            batch = chunk.to_record_batch()
            for column in batch.columns:
                if "string" in str(column.type):
                    found += _texts(column.to_pylist())
    return "\n".join(found)


def _texts(values):
    for value in values or ():
        yield from [value] if isinstance(value, str) else _texts(value)
