"""The sentences that a module can print, read from its source, so that none can stay untested."""

import ast
from pathlib import Path


def templates(module):
    """Texts of a module that are printed: literal parts of three words or more, docstrings and errors left out."""
    tree = ast.parse(Path(module.__file__).read_text("utf-8"))
    quiet = {id(one) for node in ast.walk(tree) if isinstance(node, ast.Raise | ast.Expr) for one in ast.walk(node)
             if not (isinstance(node, ast.Expr) and not isinstance(node.value, ast.Constant))}  # fmt: skip
    texts = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return {
        node.value.strip()
        for node in texts
        if id(node) not in quiet and node.value.strip().count(" ") >= 2 and "{" not in node.value
    }


def unsaid(text, *modules):
    """Templates of modules that a text does not hold."""
    return [one for module in modules for one in templates(module) if one not in text]
