"""The site has a page for README and every topic, and every link of a page leads to a file of the site."""

import re

import pytest
from support.processes import script

from replay.guide.pages import topics


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    out = tmp_path_factory.mktemp("site")
    script("site_pages").write_site(out)
    return out


def test_site_has_a_page_for_readme_index_and_every_topic(site):
    assert {path.stem for path in site.glob("*.html")} == {"index", "guide", *topics()}


def test_links_and_pictures_of_the_site_resolve(site):
    missing = []
    for path in site.glob("*.html"):
        for target in re.findall(r'(?:href|src)="([^"#]+)"', path.read_text("utf-8")):
            if not target.startswith(("http", "demo/")) and not (site / target).exists():
                missing.append((path.name, target))
    assert not missing


def test_pages_keep_their_tables_and_load_no_script(site):
    text = (site / "glossary.html").read_text("utf-8")
    assert text.count("<table>") >= 5 and "<code>hybrid-qaco</code>" in text
    assert not [path.name for path in site.glob("*.html") if "<script" in path.read_text("utf-8")]
