"""The floors that documents name are those that import-linter checks."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
IMPORT_CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
    "contracts"
]
LAYERS = {  # package -> its folders from the top layer down, "cli > studies > ...": an import may only point down
    package: " > ".join(re.sub(" [:|] ", ", ", layer) for layer in contract["layers"])
    for contract in IMPORT_CONTRACTS
    if contract["type"] == "layers"
    for package in contract.get("containers", ())
    if package in ("cdcore", "sessions", "replay")
}


@pytest.mark.parametrize("package", ("cdcore", "sessions", "replay"))
@pytest.mark.parametrize("document", ("{package}/README.md", ".github/CONTRIBUTING.md"))
def test_documents_list_the_import_layers_that_lint_checks(package, document):
    """The layers that pyproject.toml gives to import-linter stand in a document as "cli > studies > ...".

    The document may break its lines anywhere.
    """
    text = (ROOT / document.format(package=package)).read_text(encoding="utf-8")
    assert LAYERS[package] in " ".join(text.split())
