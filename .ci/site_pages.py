"""Writes README and guide as HTML pages: ``python .ci/site_pages.py DIR``; ``.ci/site`` adds the demo."""

import html
import re
import shutil
import sys
from pathlib import Path
from typing import Final

from markdown_it import MarkdownIt

from replay.guide.pages import INDEX_PAGE, page, topics

ROOT: Final = Path(__file__).resolve().parents[1]
PICTURES: Final = ROOT / ".github" / "pictures"
FRAME: Final = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 52rem; margin: 0 auto; padding: 1rem; color: #222 }}
nav a {{ margin-right: .8em }} img {{ max-width: 100% }} pre {{ background: #f4f4f4; padding: .7rem; overflow-x: auto }}
table {{ display: block; overflow-x: auto; border-collapse: collapse }}
td, th {{ border: 1px solid #ccc; padding: .25em .6em; text-align: left; vertical-align: top }}
@media (prefers-color-scheme: dark) {{
body {{ background: #151515; color: #ddd }} pre {{ background: #242424 }} a {{ color: #8bf }}
}}
</style></head><body><nav><a href="index.html">vrlab-replay</a><a href="guide.html">Guide</a><a
href="demo/index.html">Demo: report and picture</a></nav>
{body}
</body></html>
"""


def write_site(out: Path) -> list[Path]:
    """Write a page for README, the guide's index and every topic, and the pictures; returns the pages."""
    out.mkdir(parents=True, exist_ok=True)
    shutil.copytree(PICTURES, out / "pictures", dirs_exist_ok=True)
    texts = {"index": (ROOT / "README.md").read_text("utf-8"), "guide": page(INDEX_PAGE)}
    texts |= {topic: page(topic) for topic in topics()}
    written = []
    for name, text in texts.items():
        written.append(out / f"{name}.html")
        title = html.escape(text.partition("\n")[0].removeprefix("# "))
        written[-1].write_text(FRAME.format(title=title, body=_body(text)), encoding="utf-8")
    return written


def _body(text: str) -> str:
    """Markdown as HTML, with links to pages and pictures of this site and other files as plain text."""
    text = re.sub(r"<!--.*?-->\n?", "", text, flags=re.DOTALL)
    text = re.sub(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)", _relinked, text)
    return MarkdownIt("commonmark", {"html": False}).enable("table").render(text)


def _relinked(link: re.Match[str]) -> str:
    picture, text, target = link.groups()
    if target.startswith(("http:", "https:")):
        return link[0]
    stem = Path(target).stem
    if picture:
        return f"![{text}](pictures/{Path(target).name})"
    if target.endswith("guide/README.md") or target == "README.md":
        return f"[{text}](guide.html)"
    return f"[{text}]({stem}.html)" if stem in topics() else text


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for path in write_site(Path(sys.argv[1])):
        print(f"wrote {path}")
