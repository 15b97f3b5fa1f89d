"""Every text of a recording, read back from its file."""

from rerun.chunk import RrdReader


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
