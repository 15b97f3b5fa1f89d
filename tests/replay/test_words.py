"""Numbers as people read them: the rule against decimal arithmetic, and never an exponent."""

import re
from decimal import ROUND_HALF_EVEN, Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay import words

SIZES = {"nm": 1e-9, "µm": 1e-6, "mm": 1e-3, "m": 1.0, "km": 1e3, "ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0}
MEASURED = st.floats(1e-9, 1e9) | st.floats(-1e9, -1e-9)


@pytest.mark.parametrize(
    ("metres", "text"),
    [
        (0.0007, "0.7 mm"), (0.018, "18 mm"), (0.0182, "18.2 mm"), (0.3, "300 mm"), (1.2, "1.2 m"), (0.9996, "1 m"),
        (0.99949, "999 mm"), (1300, "1.3 km"), (2e-6, "2 µm"), (4e-5, "0.04 mm"), (3e-9, "3 nm"), (0.0, "0 mm"),
        (-0.0042, "-4.2 mm"), (float("nan"), "not measured"), (float("inf"), "not measured"), (None, "not measured"),
    ],
)  # fmt: skip
def test_length_is_printed_in_a_unit_of_its_size(metres, text):
    """Three digits at most, without zeros at the end."""
    assert words.length(metres) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.00013, "0.13 ms"), (0.12, "120 ms"), (4.12e-5, "0.0412 ms"), (9e-6, "9 µs"), (1.0, "1 s"), (60.0, "60 s"),
        (719.0, "12 min"), (8000.0, "2.22 h"), (0.0, "0 s"), (None, "not measured"),
    ],
)  # fmt: skip
def test_a_duration_has_the_unit_of_its_size(seconds, text):
    """Three digits at most, without zeros at the end."""
    assert words.duration(seconds) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(9.996, "10"), (0.04123, "0.0412"), (12345.6, "12,346"), (-1e-13, "0"), (None, "not measured")]
    + [(float(word), "not measured") for word in ("nan", "inf")],
)
def test_number_has_three_digits_and_no_unit(value, text):
    """Digits before the point are all there, in groups of three."""
    assert words.number(value) == text


@given(MEASURED)
def test_a_number_is_its_decimal_rounded_to_three_digits(value):
    """Expected is Python's decimal arithmetic; a carry, as of 9.996, leaves a digit more there than in the text."""
    exact = Decimal(value)
    digits = max(0, 2 - exact.adjusted())
    rounded = exact.quantize(Decimal(1).scaleb(-min(12, digits)), ROUND_HALF_EVEN)
    text = words.number(value)
    assert "e" not in text
    assert abs(Decimal(text.replace(",", "")) - rounded) <= Decimal("0.005") * abs(exact) * (rounded != exact)


@given(st.floats(1e-8, 1e5))
def test_lengths_and_durations_print_right_without_exponent(value):
    """Three figures are right to 0.51 %."""
    for text in (words.length(value), words.duration(value) if value < 600 else "1 s"):
        figure, unit = re.fullmatch(r"([\d,.]+) (\S+)", text).groups()
        back = float(figure.replace(",", "")) * SIZES[unit]
        assert text == "1 s" or back == pytest.approx(value, rel=0.0051)
        assert len(figure.replace(",", "").replace(".", "").lstrip("0")) <= 3 or float(figure.replace(",", "")) >= 1000


@pytest.mark.parametrize(
    ("fraction", "text"),
    [(0.864, "86 %"), (0.004, "0.4 %"), (0.9998, "99.98 %"), (0.0, "0 %"), (1.0, "100 %"), (None, "not measured")],
)
def test_fraction_keeps_digits_that_distinguish_it_from_0_and_100(fraction, text):
    """0.9998 is not printed as 100 %."""
    assert words.as_percentage(fraction) == text


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [(11.14, 11.1, "11.14"), (12.0, 11.1, "12"), (0.28, 0.013, "0.28"), (1.00001, 1.0, "1.00001")],
)
def test_number_above_a_limit_is_printed_above_the_limit(value, limit, text):
    """With three digits 11.14 would be 11.1, the limit itself."""
    assert words.number_above(value, limit) == text


@given(st.integers(0, 10**7), st.floats(1.0, 1000.0))
def test_moments_of_two_frames_differ(frame, rate_hz):
    """Two frames one period of the rate after another; a moment is a timestamp in seconds."""
    assert words.moment(frame / rate_hz) != words.moment((frame + 1.001) / rate_hz)
    assert words.moment(frame / rate_hz) == f"{words.timestamp(frame / rate_hz)} s"


def test_ranges_rates_moments_and_losses():
    """The forms of screens: least and most, hertz, seconds, and a loss with two digits."""
    assert [words.count_range(counts) for counts in ((0, 1), (3, 3), (999, 1200))] == ["0-1", "3", "999-1,200"]
    assert [words.rate(hertz) for hertz in (50.0, 22.5, 89.94, 1e6)] == ["50 Hz", "22.5 Hz", "89.9 Hz", "1,000,000 Hz"]
    assert [words.time_span(1.0, 1.0), words.time_span(1.0, 2.5), words.time_span(None, 1.0)] == [
        "1.000",
        "1.000 to 2.500",
        "",
    ]
    assert [words.loss_number(loss) for loss in (0.0, 0.944, 0.00312, 2.09)] == ["0", "0.94", "0.0031", "2.1"]


@pytest.mark.parametrize(
    ("value", "text"), [(1e300, "more than 1,000,000,000,000"), (-2e12, "less than -1,000,000,000,000")]
)
def test_a_number_beyond_nature_is_not_written_out(value, text):
    """1e12 is the largest number that is."""
    assert words.number(value) == text
    assert words.number(1e12) == "1,000,000,000,000"


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
    """Two digits; near 0 and 100 % as many as keep it from them."""
    assert words.interval(lower, upper) == text


@pytest.mark.parametrize(
    ("text", "single_line", "on_lines"),
    [
        ("a cup", "a cup", "a cup"),
        ("C:\\a\nb", r"C:\a\nb", "C:\\a\nb"),
        ("red\x1b[31m", r"red\x1b[31m", r"red\x1b[31m"),
        ("a\x85b", r"a\x85b", r"a\x85b"),
        ("a\u2003b", "a\u2003b", "a\u2003b"),
        ("a\u2028b", r"a\u2028b", r"a\u2028b"),
    ],
    ids=["plain", "line end", "escape", "control character", "wide space", "line separator"],
)
def test_only_invisible_characters_are_escaped(text, single_line, on_lines):
    """``on_lines``: the text where lines of its own are allowed."""
    assert (words.safe_text(text), words.safe_text(text, lines=True)) == (single_line, on_lines)


def test_plurals_and_ranges_within_a_sentence():
    """A range is (least, most); a least of 0 is not written."""
    assert [words.plural(number, "frame") for number in (0, 1, 1200)] == ["0 frames", "1 frame", "1,200 frames"]
    assert [words.plural(number, "body", "bodies") for number in (1, 2)] == ["1 body", "2 bodies"]
    assert [words.count_words(counts) for counts in ((0, 1), (1, 3), (3, 3))] == ["up to 1", "1 to 3", "3"]
