"""The site has a page for README and every topic, and every link of a page leads to a file of the site."""

import re

import pytest
from support.processes import script

from replay.guide.pages import topics


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site that the script writes from README and guide."""
    out = tmp_path_factory.mktemp("site")
    script("site_pages").write_site(out)
    return out


def test_site_has_a_page_for_readme_index_and_every_topic(site):
    """The site has a page for every topic of the guide; README is the page "index", the list of topics "guide"."""
    assert {path.stem for path in site.glob("*.html")} == {"index", "guide", *topics()}


def test_links_and_pictures_of_the_site_resolve(site):
    """Links to other sites, to places within a page and to the demo, which is published apart, are not followed."""
    targets = [
        (path.name, target)
        for path in site.glob("*.html")
        for target in re.findall(r'(?:href|src)="([^"#]+)"', path.read_text("utf-8"))
        if not target.startswith(("http", "demo/"))
    ]
    assert targets
    assert [(name, target) for name, target in targets if not (site / target).exists()] == []


def test_pages_keep_their_tables_and_load_no_script(site):
    """The page "glossary" has five tables or more, with code in their cells; no page has a script."""
    glossary = (site / "glossary.html").read_text("utf-8")
    assert glossary.count("<table>") >= 5
    assert "<code>hybrid-qaco</code>" in glossary
    assert not [path.name for path in site.glob("*.html") if "<script" in path.read_text("utf-8")]
