from xml.etree import ElementTree

import pytest

from replay.tradeoff.picture import picture
from replay.tradeoff.settings import Setting
from replay.tradeoff.trading import tradeoff


@pytest.fixture(scope="module")
def rows(bumped):
    rates = [Setting("discrete", "step rate", f"{hz} Hz", {"rate_hz": hz}) for hz in (20.0, 40.0)]
    return tradeoff(bumped, settings=[Setting("hybrid", "as it comes", ""), *rates], repeats=1).rows


def test_both_kinds_can_be_opened_and_name_what_they_show(rows):
    assert picture(rows, "Costs").startswith(b"\x89PNG")
    drawn = picture(rows, "Costs", "svg").decode()
    ElementTree.fromstring(drawn)
    for words in ("Costs", "discrete, step rate", "one frame at 90 Hz", "seconds per session minute", "the front"):
        assert f"<!-- {words}" in drawn or words in drawn


def test_no_row_is_no_picture():
    with pytest.raises(ValueError, match="no row"):
        picture([], "Costs")
