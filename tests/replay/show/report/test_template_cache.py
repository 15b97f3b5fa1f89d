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


def rendered(template="{{ 2 + number }}"):
    """The text of a template with 3 as its number, and how many templates were compiled for it."""
    compiled = []

    class CountingEnvironment(Environment):
        def compile(self, source, *rest, **named):
            compiled.append(source)
            return super().compile(source, *rest, **named)

    environment = CountingEnvironment(
        loader=DictLoader({"page.html": template}), bytecode_cache=TemplateCache(), optimized=False
    )
    return environment.get_template("page.html").render(number=3), len(compiled)


def test_compiled_template_is_used_again(cache_folder):
    """The template ``2 + number`` gives "5" for 3. It is compiled the first time (1 template), not the second (0)."""
    assert rendered() == ("5", 1)
    assert rendered() == ("5", 0)


def test_damaged_code_of_a_template_is_compiled_again(cache_folder):
    """The template ``2 + number`` was compiled; then nine bytes are cut off the only file of compiled code.

    For 3 it gives "5", and one template is compiled once more.
    """
    rendered()
    (file,) = cache_folder.iterdir()
    file.write_bytes(file.read_bytes()[:-9])
    assert rendered() == ("5", 1)


def test_changed_template_is_compiled_again(cache_folder):
    """The same file of the template adds 2 to 3 first, then 3 to 3; each time one template is compiled."""
    assert rendered("{{ 2 + number }}") == ("5", 1)
    assert rendered("{{ 3 + number }}") == ("6", 1)


def test_page_is_rendered_without_a_writable_template_cache(cache_folder):
    """A file stands where the folder of compiled code would be: the template is compiled each time (1)."""
    cache_folder.write_text("no folder")
    assert rendered() == ("5", 1)
    assert rendered() == ("5", 1)
