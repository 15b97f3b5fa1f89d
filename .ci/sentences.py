"""Prints every sentence that a user can meet: ``python .ci/sentences.py``; with ``--riddles`` those that read badly.

A sentence is a text of at least three words in the code of the tool (help, terminal, report, errors), in its templates
and in its catalogues. A docstring counts where it is the help of a verb.
"""

import ast
import html
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("cdcore", "sessions", "replay")
LEAST_WORDS = 3

RIDDLES = {
    "opens with Of, What or As": r"(?:^|[.:] )(?:Of|What|As) (?!if\b|soon\b|long\b|each detector\b)[a-z]",
    "told from, told apart": r"\btold (?:from|apart)\b",
    "ask for run, test or query": r"\b[Aa](?:sks?|sked|sking)\b(?! (?:for|you)\b)",
    "look for sample": r"\blooks? (?:at|that|between)\b|\beach look\b|\bevery look\b|\bits looks\b",
    "none of": r"\b[Nn]one of\b",
    "unasked": r"\bunasked\b",
    "in part": r"\bmissed in part\b",
    "a person where a thing is meant": r"\b[Ww]ho(?:m|se)? (?:asks|says|sees|answers)\b",
    "a sentence that readers could not follow": (
        r"a link to one recording|joined without guessing|no table of this machine|where you may pass it on|"
        r"no row asks|No cut that was tried|What is not round|suppose that|as a multiple of the first|One card a pair|"
        r"surely quicker|Take out of a recording|without a past|which is what a new project|counting rule unknown|"
        r"as exact sees|was told from|calls? for"
    ),
}
"""Name of a habit -> pattern of the sentences that have it."""

FORMATS = re.compile(r"^[\s\W\d]*$|^[a-z_]+(?:[ ,][a-z_]+)*$|</?\w+[^>]*>|^SELECT|^\W*--")


def sentences(folders: Iterable[str] = PACKAGES) -> Iterator[tuple[str, int, str]]:
    """File, line and text of every sentence of these packages or folders of them."""
    for path in (path for folder in folders for path in sorted((ROOT / folder).rglob("*"))):
        name = str(path.relative_to(ROOT))
        if path.suffix == ".py":
            result = _of_code(ast.parse(path.read_text("utf-8")))
        elif path.suffix == ".html":
            result = _of_template(path.read_text("utf-8"))
        elif path.suffix == ".toml" and path.parent.name != "experiments":  # tasks of a made-up student
            result = _of_catalogue(path.read_text("utf-8"))
        else:
            continue
        for line, text in result:
            if len(re.findall(r"[A-Za-z]{2,}", text)) >= LEAST_WORDS and " " in text.strip():
                yield name, line, " ".join(text.split())


def riddles(printed: Iterable[tuple[str, int, str]]) -> list[str]:
    """A line for every sentence that has one of the habits: file, line, habit, text."""
    return [
        f"{name}:{line}: {habit}: {text}"
        for name, line, text in printed
        for habit, pattern in RIDDLES.items()
        if re.search(pattern, text)
    ]


def _of_code(tree: ast.Module) -> Iterator[tuple[int, str]]:
    nodes = [*ast.walk(tree)]
    inside = {id(value) for node in nodes if isinstance(node, ast.JoinedStr) for value in node.values}
    for node in nodes:
        for text in _docstrings(node):
            inside.add(id(text))
            if isinstance(node, ast.FunctionDef) and _is_verb(node):
                yield text.lineno, str(text.value)
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            yield node.lineno, "".join(str(v.value) if isinstance(v, ast.Constant) else "..." for v in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside:
            yield node.lineno, node.value


def _docstrings(node: ast.AST) -> list[ast.Constant]:
    """The string statements directly below a node: docstrings, those of constants too."""
    body = getattr(node, "body", None)
    statements = body if isinstance(body, list) else []
    values = [item.value for item in statements if isinstance(item, ast.Expr)]
    return [value for value in values if isinstance(value, ast.Constant) and isinstance(value.value, str)]


def _is_verb(node: ast.FunctionDef) -> bool:
    return any(
        "command" in ast.unparse(decorator) or "group" in ast.unparse(decorator) for decorator in node.decorator_list
    )


def _of_template(text: str) -> Iterator[tuple[int, str]]:
    plain = re.sub(r"<(script|style)\b.*?</\1>", lambda m: "\n" * m[0].count("\n"), text, flags=re.DOTALL)
    plain = re.sub(r"\{%.*?%\}|\{#.*?#\}", "", plain, flags=re.DOTALL)
    for number, line in enumerate(plain.splitlines(), 1):
        yield number, html.unescape(re.sub(r"<[^>]*>|\{\{.*?\}\}", "...", line)).strip()


def _of_catalogue(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.splitlines(), 1):
        for value in re.findall(r'"([^"]*)"', line):
            yield number, value


if __name__ == "__main__":
    if "--riddles" in sys.argv[1:]:
        lines = riddles(sentences())
        print(*lines, sep="\n")
        sys.exit(bool(lines))
    for name, line, text in sentences():
        print(f"{name}:{line}: {text}")
