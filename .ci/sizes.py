"""How large the project is, in what layout cannot hide.  python .ci/sizes.py

Files, tokens and functions of each package, lines with `fmt: skip`, verbs and options of the command line, README.
A token is what Python's tokenizer yields, without comments, docstrings, line ends and indentation. CI prints this; no
test limits it, because limits were met by denser lines.
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import click

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("cdcore", "sessions", "replay", "tests")
MOST_PARAMETERS = 8
LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
EVERYWHERE = {"verbose", "quiet", "debug", "format_", "help"}
"""Options that every verb has; they are not counted."""


def python_files(folder: str) -> list[Path]:
    """All Python files that git tracks below a folder."""
    command = ["git", "-C", str(ROOT), "ls-files", folder]
    listed = subprocess.run(command, capture_output=True, text=True, check=True)
    return [ROOT / name for name in listed.stdout.splitlines() if name.endswith(".py") and (ROOT / name).exists()]


def docstrings(tree: ast.AST) -> set[tuple[int, int]]:
    """Where strings stand that are statements of their own."""
    return {
        (node.value.lineno, node.value.col_offset)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    }


def count_tokens(source: str) -> int:
    """Tokens of one file."""
    left_out = docstrings(ast.parse(source))
    return sum(
        token.type not in LAYOUT and not (token.type == tokenize.STRING and token.start in left_out)
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
    )


def parameter_counts(source: str) -> list[int]:
    """Parameters of every function and method."""
    counts = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            arguments = node.args
            counts.append(len(arguments.posonlyargs) + len(arguments.args) + len(arguments.kwonlyargs))
    return counts


def skipped_lines(source: str) -> int:
    """Comments that keep the formatter away."""
    return sum(
        token.type == tokenize.COMMENT and "fmt: skip" in token.string
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
    )


def leaves(command: click.Command, name: str) -> Iterator[tuple[str, click.Command]]:
    """A verb, or each verb below a group; what help does not show is left out."""
    import click

    if command.hidden:
        return
    if not isinstance(command, click.Group):
        yield name, command
        return
    context = click.Context(command)
    for inner in command.list_commands(context):
        result = command.get_command(context, inner)
        if result is not None:
            yield from leaves(result, f"{name} {inner}")


def own_options(command: click.Command) -> list[str]:
    """Options of a verb that not every verb has; a switch and its opposite are one."""
    import click

    return [
        option.opts[0]
        for option in command.params
        if isinstance(option, click.Option) and option.name not in EVERYWHERE and not option.hidden
    ]


def verbs() -> dict[str, list[str]]:
    """Every verb of the command line with its options."""
    sys.path.insert(0, str(ROOT))
    from replay.cli.main import cli

    return {name.removeprefix("replay "): own_options(command) for name, command in leaves(cli, "replay")}


def main() -> None:
    """Print sizes by package, verbs with their options, and the size of the README."""
    print(f"{'':<10}{'files':>6}{'tokens':>9}{'functions':>11}{'over 8 parameters':>19}{'most':>6}{'fmt: skip':>11}")
    total = 0
    for package in PACKAGES:
        sources = [file.read_text(encoding="utf-8") for file in python_files(package)]
        tokens = sum(map(count_tokens, sources))
        parameters = [count for source in sources for count in parameter_counts(source)]
        wide = sum(count > MOST_PARAMETERS for count in parameters)
        skips = sum(map(skipped_lines, sources))
        row = f"{package:<10}{len(sources):>6}{tokens:>9,}{len(parameters):>11,}{wide:>19}{max(parameters):>6}"
        print(f"{row}{skips:>11}")
        if package != "tests":
            total += tokens
    print(f"source {total:,} tokens")
    listed = verbs()
    for name, options in sorted(listed.items()):
        print(f"{name:<16}{len(options):>3}  {' '.join(options)}")
    print(f"{len(listed)} verbs, {sum(map(len, listed.values()))} options besides -v -q --debug --format -h")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    print(f"README: {len(readme.split()):,} words, {len(readme.encode()):,} bytes")


if __name__ == "__main__":
    main()
