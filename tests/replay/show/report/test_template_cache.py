"""The code of templates is kept, and compiled again where its file is damaged."""

import pytest
from jinja2 import DictLoader, Environment

from replay.show.report import template_cache
from replay.show.report.template_cache import TemplateCache


@pytest.fixture
def cache_folder(tmp_path, monkeypatch):
    """The folder of compiled templates, where bytecode may be written."""
    monkeypatch.setattr(template_cache, "files", lambda _: tmp_path)
    monkeypatch.setattr(template_cache.sys, "dont_write_bytecode", False)
    monkeypatch.setattr(template_cache.sys, "pycache_prefix", None)
    return tmp_path / "__pycache__"


def text_of(template="{{ 2 + number }}"):
    """The page, and how many templates were compiled for it."""
    compiled = []

    class Counting(Environment):
        def compile(self, source, *rest, **named):
            compiled.append(source)
            return super().compile(source, *rest, **named)

    environment = Counting(loader=DictLoader({"page.html": template}), bytecode_cache=TemplateCache(), optimized=False)
    return environment.get_template("page.html").render(number=3), len(compiled)


def test_kept_code_is_used_until_damaged_or_template_changes(cache_folder):
    """The template adds 2, then 3, to 3; the second number is how many templates were compiled.

    The kept file is cut by 9 bytes.
    """
    assert text_of() == ("5", 1)
    assert text_of() == ("5", 0)
    (file,) = cache_folder.iterdir()
    file.write_bytes(file.read_bytes()[:-9])
    assert text_of() == ("5", 1)
    assert text_of("{{ 3 + number }}") == ("6", 1)


def test_page_is_rendered_without_a_writable_template_cache(cache_folder):
    """The template adds 2 to 3; it is compiled, and nothing is kept."""
    cache_folder.write_text("a file where the folder would be")
    assert text_of() == ("5", 1)
