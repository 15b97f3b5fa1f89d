"""Numbers are formatted in one module: elsewhere no format states digits or decimals."""

import ast
import re
from pathlib import Path

import pytest

import replay

TOP = Path(replay.__file__).parent
DIGITS = re.compile(r"\.\d+[gGeEfF%]")
"""Formats of so many significant digits, which turn to an exponent where a number is large, or of so many decimals."""

EXCEPTIONS = {
    "words.py": "the module itself",
    "studies/class_study": "coefficients, p values and other statistics, which have no unit",
    "show/paper_table.py": "figures of the paper, which are compared digit by digit",
    "studies/stress": "labels of planted scales",
    "studies/paper": "figures of the paper, which are compared digit by digit",
    "show/report/charts.py": "coordinates of SVG",
    "show/report/still.py": "coordinates of SVG",
    "cli/study_tables.py": "statistics, which have no unit",
    "running/contact_import.py": "facts for a program to read back",
}
"""File or folder of ``replay`` -> the reason why it states digits of its own."""


def formats(tree):
    """Line and format of every formatted value, format string and ``show`` of a column in a syntax tree."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FormattedValue) and node.format_spec is not None:
            pieces = [piece.value for piece in node.format_spec.values if isinstance(piece, ast.Constant)]
            yield node.lineno, "".join(map(str, pieces))
        elif isinstance(node, ast.keyword) and node.arg == "show" and isinstance(node.value, ast.Constant):
            yield node.value.lineno, str(node.value.value)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            for result in re.findall(r"\{[^{}]*:([^{}]*)\}", node.value):
                yield node.lineno, result


def test_no_format_outside_its_module_states_digits_or_decimals():
    """No format like .2f or .3g stands in the sources of ``replay``, but for EXCEPTIONS."""
    formats_with_digits = []
    for file in sorted(TOP.rglob("*.py")):
        name = file.relative_to(TOP).as_posix()
        if any(name == exception or name.startswith(f"{exception}/") for exception in EXCEPTIONS):
            continue
        source = file.read_text("utf-8")
        if DIGITS.search(source):
            for line, text in formats(ast.parse(source)):
                if DIGITS.search(text):
                    formats_with_digits.append(f"{name}:{line} {text}")
    assert formats_with_digits == []


@pytest.mark.parametrize(
    ("code", "formats_with_digits"),
    [
        pytest.param('a = f"{x:.2g} mm"', [".2g"], id="f-string"),
        pytest.param('b = "{:.3g}".format', [".3g"], id="format of a string"),
        pytest.param('c = Column(show=".1e")', [".1e"], id="column"),
        pytest.param('d = f"{x:,.0f} {y:g}"', [",.0f"], id="decimals, and a g without digits"),
    ],
)
def test_the_search_sees_formats_of_every_kind(code, formats_with_digits):
    """The search for formats in sources lists every one of a line of code that states digits or decimals."""
    assert [text for _, text in formats(ast.parse(code)) if DIGITS.search(text)] == formats_with_digits


def test_columns_in_toml_name_a_format_function_without_digits():
    """One file describes the columns of tables; more than 20 say how they are shown, none with digits."""
    (columns,) = [file for file in TOP.rglob("*.toml") if "meaning =" in file.read_text("utf-8")]
    shows = re.findall(r'show = "([^"]*)"', columns.read_text("utf-8"))
    assert len(shows) > 20
    assert not [show for show in shows if re.search(r"\.\d", show)]
