"""Numbers are formatted in one module: elsewhere no format states digits or decimals."""

import ast
import re
from pathlib import Path

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
    """No format like .2f or .3g stands in the sources of replay, but for EXCEPTIONS, each of which has its reason."""
    result = []
    for file in sorted(TOP.rglob("*.py")):
        name = file.relative_to(TOP).as_posix()
        if not any(name == exception or name.startswith(f"{exception}/") for exception in EXCEPTIONS):
            source = file.read_text("utf-8")
            if DIGITS.search(source):
                result += [f"{name}:{line} {text}" for line, text in formats(ast.parse(source)) if DIGITS.search(text)]
    assert result == []


def test_the_search_sees_formats_of_every_kind():
    """Formats of an f-string, of a string with ``format``, of a column's ``show``; g without digits is none."""
    code = 'a = f"{x:.2g} mm"\nb = "{:.3g}".format\nc = Column(show=".1e")\nd = f"{x:,.0f} {y:g}"'
    assert [result for _, result in formats(ast.parse(code)) if DIGITS.search(result)] == [".2g", ".3g", ".1e", ",.0f"]


def test_columns_in_toml_name_a_format_function_without_digits():
    """The one file of columns, in which more than 20 have a ``show``."""
    (columns,) = [file for file in TOP.rglob("*.toml") if "meaning =" in file.read_text("utf-8")]
    shows = re.findall(r'show = "([^"]*)"', columns.read_text("utf-8"))
    assert len(shows) > 20
    assert not [show for show in shows if re.search(r"\.\d", show)]
