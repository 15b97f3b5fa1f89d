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


@pytest.mark.parametrize(
    ("width", "height"),
    [
        pytest.param(3, 2, id="small"),
        pytest.param(LARGEST_SIDE_PIXELS, 1, id="as wide as allowed"),
        pytest.param(1, LARGEST_SIDE_PIXELS, id="as high as allowed"),
    ],
)
def test_still_of_a_recording_is_passed_on_as_pixels(monkeypatch, tmp_path, width, height):
    """A recording has a picture as base64 of WebP; a page gets one of the same size, drawn anew."""
    monkeypatch.setattr(leading_still, "read_texts", lambda *_: (None, [webp_text(width, height)]))
    with Image.open(BytesIO(b64decode(read_still(tmp_path / "run.rrd")))) as image:
        assert image.format == "WEBP"
        assert image.size == (width, height)


@pytest.mark.parametrize(
    "stills",
    [
        pytest.param([], id="none"),
        pytest.param(["no base64"], id="no base64"),
        pytest.param(["AAAA"], id="three zeros, no picture"),
        pytest.param([webp_text(LARGEST_SIDE_PIXELS + 1, 1)], id="a pixel too wide"),
        pytest.param([webp_text(1, LARGEST_SIDE_PIXELS + 1)], id="a pixel too high"),
    ],
)
def test_absent_damaged_or_huge_still_is_left_out(monkeypatch, tmp_path, stills):
    """``stills``: texts that a recording has as pictures; a page gets none ("")."""
    monkeypatch.setattr(leading_still, "read_texts", lambda *_: (None, stills))
    assert read_still(tmp_path / "run.rrd") == ""
