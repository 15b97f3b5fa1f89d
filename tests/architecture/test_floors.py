"""The floors that documents name are those that import-linter checks."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
FLOORS = {
    package: " > ".join(re.sub(" [:|] ", ", ", layer) for layer in contract["layers"])
    for contract in CONTRACTS
    if contract["type"] == "layers"
    for package in contract.get("containers", ())
    if package in ("cdcore", "sessions", "replay")
}


@pytest.mark.parametrize("package", ("cdcore", "sessions", "replay"))
@pytest.mark.parametrize("document", ("{package}/README.md", ".github/CONTRIBUTING.md"))
def test_documents_name_the_checked_floors(package, document):
    text = (ROOT / document.format(package=package)).read_text(encoding="utf-8")
    assert FLOORS[package] in " ".join(text.split())
