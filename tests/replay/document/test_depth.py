"""The depth of a contact in words."""

import pytest

from replay.document.depth import depth_text


@pytest.mark.parametrize(
    ("depth", "at_least", "text"),
    [
        (None, False, ""),
        (float("nan"), False, ""),
        (0.0024, False, "2.4 mm deep"),
        (0.0024, True, "at least 2.4 mm deep"),
        (0.0004, False, "0.4 mm deep, as tracker noise could make"),
        (0.0004, True, "at least 0.4 mm deep"),
        (0.0, False, "0 mm deep"),
    ],
)
def test_depth_is_named_where_it_is_known(depth, at_least, text):
    """Metres, None or NaN where the depth is not known. The noise of two trackers makes contacts of up to 0.73 mm.

    ``at_least``: some frames were not searched, so that the contact may be deeper than noise makes it.
    """
    assert depth_text(depth, at_least=at_least) == text
