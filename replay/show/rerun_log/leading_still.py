"""The still of the leading fault inside a recording, for pages that are made from the recording alone."""

import re
from base64 import b64decode, b64encode
from binascii import Error
from io import BytesIO
from pathlib import Path
from typing import Final

import rerun as rr

from replay.errors import RunFolderError
from replay.show.rerun_log.recording_file import RecordingWriter
from replay.show.rerun_log.recording_reader import RecordingDamagedError, read_texts

STILL_ENTITY: Final = "moments/still"

LARGEST_SIDE_PIXELS: Final = 2000
"""Pixels of a side at most."""


def log_still(writer: RecordingWriter, drawing: str) -> None:
    """Send the picture inside a drawing of the fault that the answer is about, as WebP in base64."""
    (raster_base64,) = re.findall(r"data:image/webp;base64,([A-Za-z0-9+/=]*)", drawing)
    writer.static(STILL_ENTITY, rr.AnyValues(raster=raster_base64))


def read_still(recording: Path) -> str:
    """Return the picture in a recording as WebP in base64, encoded anew; ``""``: there is none that can be read.

    Anybody may have sent the recording: only pixels are passed on.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        _, texts = read_texts(recording, f"/{STILL_ENTITY}", "raster")
        if not texts:
            return ""
        with Image.open(BytesIO(b64decode(texts[0], validate=True)), formats=["WEBP"]) as image:
            if max(image.size) > LARGEST_SIDE_PIXELS:
                return ""
            buffer = BytesIO()
            image.convert("RGB").save(buffer, "WEBP", quality=82, method=2)
    except (OSError, ValueError, Error, UnidentifiedImageError, RecordingDamagedError, RunFolderError):
        return ""
    return b64encode(buffer.getvalue()).decode()
