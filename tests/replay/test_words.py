"""Numbers as people read them: the rule against decimal arithmetic, and never an exponent."""

import re
from decimal import ROUND_HALF_EVEN, Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay import words

SIZES = {"nm": 1e-9, "µm": 1e-6, "mm": 1e-3, "m": 1.0, "km": 1e3, "ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0}
"""Units of texts, in metres or seconds."""
MEASURED = st.floats(1e-9, 1e9) | st.floats(-1e9, -1e-9)
"""Numbers as measurements give them, of either sign."""


def test_length_is_printed_in_a_unit_of_its_size():
    """Three digits at most, without zeros at the end, from nanometres to kilometres; millimetres go from 0.01 to 999.

    NaN, infinity and None are not measured.
    """
    for metres, text in (
        (0.0007, "0.7 mm"), (0.018, "18 mm"), (0.0182, "18.2 mm"), (0.3, "300 mm"), (1.2, "1.2 m"), (0.9996, "1 m"),
        (0.99949, "999 mm"), (1300, "1.3 km"), (2e-6, "2 µm"), (4e-5, "0.04 mm"), (3e-9, "3 nm"), (0.0, "0 mm"),
        (-0.0042, "-4.2 mm"), (float("nan"), "not measured"), (float("inf"), "not measured"), (None, "not measured"),
    ):  # fmt: skip
        assert words.length(metres) == text, metres


def test_a_duration_has_the_unit_of_its_size():
    """Three digits at most, without zeros at the end; milliseconds begin at 0.01.

    719 s are 11.98 min, and 8000 s 2.222 h. None is not measured.
    """
    for seconds, text in (
        (0.00013, "0.13 ms"), (0.12, "120 ms"), (4.12e-5, "0.0412 ms"), (9e-6, "9 µs"), (1.0, "1 s"), (60.0, "60 s"),
        (719.0, "12 min"), (8000.0, "2.22 h"), (0.0, "0 s"), (None, "not measured"),
    ):  # fmt: skip
        assert words.duration(seconds) == text, seconds


def test_number_has_three_digits_and_no_unit():
    """Three digits, but all that stand before the point, in groups of three; below 1e-12 a number is 0."""
    for value, text in (
        (9.996, "10"), (0.04123, "0.0412"), (12345.6, "12,346"), (-1e-13, "0"),
        (None, "not measured"), (float("nan"), "not measured"), (float("inf"), "not measured"),
    ):  # fmt: skip
        assert words.number(value) == text, value


@given(MEASURED)
def test_a_number_is_its_decimal_rounded_to_three_digits(value):
    """Expected is Python's decimal arithmetic: three digits, at most 12 after the point, and all before it.

    A carry, as of 9.996, leaves a digit more there (10.00) than in the text (10.0): half a percent at most.
    """
    exact = Decimal(value)
    digits_after_point = min(12, max(0, 2 - exact.adjusted()))
    rounded = exact.quantize(Decimal(1).scaleb(-digits_after_point), ROUND_HALF_EVEN)
    text = words.number(value)
    assert "e" not in text
    most_difference = Decimal(0) if rounded == exact else Decimal("0.005") * abs(exact)
    assert abs(Decimal(text.replace(",", "")) - rounded) <= most_difference


@given(st.floats(1e-8, 1e5))
def test_lengths_print_right_without_exponent(metres):
    """A figure and a unit, with at most three digits but those before the point: right to half a unit of the third."""
    assert_right_to_three_digits(words.length(metres), metres)


@given(st.floats(1e-8, 600.0, exclude_max=True))
def test_durations_print_right_without_exponent(seconds):
    """A figure and a unit, with at most three digits but those before the point; from ten minutes on it is minutes."""
    assert_right_to_three_digits(words.duration(seconds), seconds)


def assert_right_to_three_digits(text, value):
    """Fails unless a text is a figure and a unit of SIZES, and with three digits that value to 0.51 %."""
    figure, unit = re.fullmatch(r"([\d,.]+) (\S+)", text).groups()
    printed = float(figure.replace(",", ""))
    assert printed * SIZES[unit] == pytest.approx(value, rel=0.0051)
    digits = figure.replace(",", "").replace(".", "").lstrip("0")
    assert len(digits) <= 3 or printed >= 1000


@pytest.mark.parametrize(
    ("fraction", "text"),
    [(0.864, "86 %"), (0.004, "0.4 %"), (0.9998, "99.98 %"), (0.0, "0 %"), (1.0, "100 %"), (None, "not measured")],
)
def test_fraction_keeps_digits_that_distinguish_it_from_0_and_100(fraction, text):
    """Whole percent, but 0.004 is not printed as 0 %, nor 0.9998 as 100 %."""
    assert words.as_percentage(fraction) == text


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [
        pytest.param(11.14, 11.1, "11.14", id="a digit more"),
        pytest.param(12.0, 11.1, "12", id="far above"),
        pytest.param(0.28, 0.013, "0.28", id="far above a small limit"),
        pytest.param(1.00001, 1.0, "1.00001", id="three digits more"),
    ],
)
def test_number_above_a_limit_is_printed_above_the_limit(value, limit, text):
    """It has as many digits as it takes: with three, 11.14 would be 11.1, the limit itself."""
    assert words.number_above(value, limit) == text


@given(st.integers(0, 10**7), st.floats(1.0, 1000.0))
def test_moments_of_two_frames_differ(frame, rate_hz):
    """Two frames follow each other at up to 1000 Hz; a moment is a timestamp and its unit, and the two differ."""
    moment, next_moment = words.moment(frame / rate_hz), words.moment((frame + 1.001) / rate_hz)
    assert moment != next_moment
    assert moment == f"{words.timestamp(frame / rate_hz)} s"


@pytest.mark.parametrize(("counts", "text"), [((0, 1), "0-1"), ((3, 3), "3"), ((999, 1200), "999-1,200")])
def test_range_of_counts_is_least_and_most(counts, text):
    """``counts``: least and most of several, as they stand in a table; one number where they are equal."""
    assert words.count_range(counts) == text


@pytest.mark.parametrize(
    ("hertz", "text"), [(50.0, "50 Hz"), (22.5, "22.5 Hz"), (89.94, "89.9 Hz"), (1e6, "1,000,000 Hz")]
)
def test_rate_is_a_number_in_hertz(hertz, text):
    """Three digits, and all before the point, which stand in groups of three."""
    assert words.rate(hertz) == text


@pytest.mark.parametrize(("start", "end", "text"), [(1.0, 1.0, "1.000"), (1.0, 2.5, "1.000 to 2.500"), (None, 1.0, "")])
def test_time_span_has_both_ends_to_a_millisecond(start, end, text):
    """Seconds; one number where both ends are equal, and nothing where one is unknown."""
    assert words.time_span(start, end) == text


@pytest.mark.parametrize(("loss", "text"), [(0.0, "0"), (0.944, "0.94"), (0.00312, "0.0031"), (2.09, "2.1")])
def test_loss_has_two_digits(loss, text):
    """A loss, by which detectors are ranked, is 0 (right) to 3."""
    assert words.loss_number(loss) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1e12, "1,000,000,000,000"),
        (1e300, "more than 1,000,000,000,000"),
        (-2e12, "less than -1,000,000,000,000"),
    ],
)
def test_a_number_beyond_nature_is_not_written_out(value, text):
    """1e12 is the largest number that is written out."""
    assert words.number(value) == text


@pytest.mark.parametrize(
    ("lower", "upper", "text"),
    [
        (0.1612, 0.9955, "16 to 100 %"),
        (0.0, 0.49, "0 to 49 %"),
        (0.7, 0.7, "70 to 70 %"),
        (0.0021, 0.0149, "0.2 to 1.5 %"),
        (0.99612, 0.99987, "99.61 to 99.99 %"),
        (0.0, 1.0, "0 to 100 %"),
    ],
)
def test_an_interval_is_rounded_outwards(lower, upper, text):
    """Two digits, the lower end rounded down and the upper one up; near 0 and 100 % as many as keep it from them."""
    assert words.interval(lower, upper) == text


@pytest.mark.parametrize(
    ("text", "single_line", "on_lines"),
    [
        pytest.param("a cup", "a cup", "a cup", id="plain"),
        pytest.param("C:\\a\nb", r"C:\a\nb", "C:\\a\nb", id="line end"),
        pytest.param("red\x1b[31m", r"red\x1b[31m", r"red\x1b[31m", id="escape"),
        pytest.param("a\x85b", r"a\x85b", r"a\x85b", id="control character"),
        pytest.param("a\u2003b", "a\u2003b", "a\u2003b", id="wide space"),
        pytest.param("a\u2028b", r"a\u2028b", r"a\u2028b", id="line separator"),
    ],
)
def test_only_invisible_characters_are_escaped(text, single_line, on_lines):
    """``single_line``: the text on one line; ``on_lines``: where it may have line ends of its own."""
    assert words.safe_text(text) == single_line
    assert words.safe_text(text, lines=True) == on_lines


@pytest.mark.parametrize(
    ("number", "frames", "bodies"),
    [(0, "0 frames", "0 bodies"), (1, "1 frame", "1 body"), (1200, "1,200 frames", "1,200 bodies")],
)
def test_plural_is_written_for_every_number_but_1(number, frames, bodies):
    """The plural has an s behind, unless another word is given."""
    assert words.plural(number, "frame") == frames
    assert words.plural(number, "body", "bodies") == bodies


@pytest.mark.parametrize(("counts", "text"), [((0, 1), "up to 1"), ((1, 3), "1 to 3"), ((3, 3), "3")])
def test_range_within_a_sentence_has_no_least_of_0(counts, text):
    """``counts``: least and most of several, as they stand in a sentence; one number where they are equal."""
    assert words.count_words(counts) == text
