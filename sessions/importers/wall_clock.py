"""Stamps of dates and times in text."""

import calendar
import re
from datetime import datetime
from typing import Final

import numpy as np

from sessions.importers.ledger import Stamps

DAY_NS: Final = 86_400_000_000_000
NO_YEAR: Final = 1900  # What strptime says of a time of day without a date
FRACTION: Final = re.compile(r"(?:(?<=:[0-9]{2}:[0-9]{2})|(?<=T[0-9]{6}))[.,]([0-9]+)")
"""The fraction of a second in ISO 8601, with and without colons."""


def wall_clock_ns(text: str, form: str = "") -> int:
    """Nanoseconds since 1970 of a date and time; without a zone it is UTC, a time of day counts from midnight.

    ``form``: as ``datetime.strptime`` takes it, exact to the microsecond; ``""``: ISO 8601, to the last of nine digits.
    ValueError: the text is none.
    """
    fraction = None if form else FRACTION.search(text)
    if form:
        moment = datetime.strptime(text, form)
        if moment.year == NO_YEAR:
            moment = moment.replace(year=1970)
    else:
        moment = datetime.fromisoformat(FRACTION.sub("", text, count=1))
    nanoseconds = int(fraction[1][:9].ljust(9, "0")) if fraction else moment.microsecond * 1000
    return calendar.timegm(moment.utctimetuple()) * 1_000_000_000 + nanoseconds


def past_midnight(stamps: Stamps) -> Stamps:
    """Times of day that go on in the next day where one is more than half a day before the last, (n,)."""
    if not len(stamps):
        return stamps
    days = np.concatenate([[0], np.cumsum(-np.rint(np.diff(stamps) / DAY_NS).astype(np.int64))])
    return stamps + (days - days.min()) * DAY_NS
