"""The still inside a recording, as a page takes it over."""

from base64 import b64decode, b64encode
from io import BytesIO

import pytest
from PIL import Image

from replay.show.rerun_log import leading_still
from replay.show.rerun_log.leading_still import LARGEST_SIDE_PIXELS, read_still


def webp_text(width, height):
    """A black WebP picture of so many pixels in base64."""
    buffer = BytesIO()
    Image.new("RGB", (width, height)).save(buffer, "WEBP")
    return b64encode(buffer.getvalue()).decode()


@pytest.mark.parametrize("size", [(3, 2), (LARGEST_SIDE_PIXELS, 1), (1, LARGEST_SIDE_PIXELS)])
def test_still_of_a_recording_is_passed_on_as_pixels(monkeypatch, tmp_path, size):
    """``size``: width and height in pixels."""
    monkeypatch.setattr(leading_still, "read_texts", lambda *_: (None, [webp_text(*size)]))
    with Image.open(BytesIO(b64decode(read_still(tmp_path / "run.rrd")))) as image:
        assert (image.format, image.size) == ("WEBP", size)


@pytest.mark.parametrize(
    "texts",
    [[], ["no base64"], ["AAAA"], [webp_text(LARGEST_SIDE_PIXELS + 1, 1)], [webp_text(1, LARGEST_SIDE_PIXELS + 1)]],
)
def test_absent_damaged_or_huge_still_is_left_out(monkeypatch, tmp_path, texts):
    """``texts``: stills in a recording: none, no base64, no picture, or a side one pixel too long."""
    monkeypatch.setattr(leading_still, "read_texts", lambda *_: (None, texts))
    assert read_still(tmp_path / "run.rrd") == ""
