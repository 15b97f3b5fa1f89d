"""The pages of the guide: which there are, and the text of one. Markdown files beside this module."""

import re
from pathlib import Path
from typing import Final

from replay.errors import OutputError
from sessions.whole_files import whole_file

PAGES_FOLDER: Final = Path(__file__).parent

INDEX_PAGE: Final = "README"
"""The page that a code host shows for the folder: it links all others, in reading order."""

SCRIPTS_OF_PAGE: Final = {"your-recording": ("VrLabRecorder.cs", "VrLabColliders.cs")}
"""Page -> files beside it that a reader takes along."""

LINK_PATTERN: Final = re.compile(r"\[([^\]]*)\]\(([^)\s]+)\)")
IMAGE_PATTERN: Final = re.compile(r"!\[[^\]]*\]\([^)]*\)\n*")
COMMENT_PATTERN: Final = re.compile(r"<!--.*?-->\n*", re.DOTALL)


def topics() -> list[str]:
    """The names of all pages but the index, in the order in which the index links them."""
    linked = [
        Path(target).stem for _, target in LINK_PATTERN.findall(page(INDEX_PAGE)) if re.fullmatch(r"[\w-]+\.md", target)
    ]
    return list(dict.fromkeys(linked))


def page(topic: str) -> str:
    """The Markdown of a page; ``topic`` is one of ``topics()`` or ``INDEX_PAGE``."""
    return (PAGES_FOLDER / f"{topic}.md").read_text("utf-8")


def write_scripts(topic: str, folder: Path) -> list[Path]:
    """Write the scripts that belong to a page, such as the C# for Unity, into a folder; their paths.

    Raises ``OutputError``: the page has none, or another file of that name is there.
    """
    scripts = [PAGES_FOLDER / name for name in SCRIPTS_OF_PAGE.get(topic, ())]
    if not scripts:
        raise OutputError(f"the page {topic!r} has no scripts; pages with some: {', '.join(SCRIPTS_OF_PAGE)}")
    for script in scripts:
        target = folder / script.name
        if target.exists() and target.read_bytes() != script.read_bytes():
            raise OutputError(f"{target} is there already and differs; move it away")
    for script in scripts:
        with whole_file(folder / script.name, OutputError) as file:
            file.write(script.read_bytes())
    return [folder / script.name for script in scripts]


def for_terminal(text: str) -> str:
    """A page without what a terminal cannot show; a link to another page becomes the command that prints it."""
    return LINK_PATTERN.sub(_as_command, COMMENT_PATTERN.sub("", IMAGE_PATTERN.sub("", text)))


def _as_command(link: re.Match[str]) -> str:
    label, target = link.groups()
    if target.startswith("http"):
        return link[0]
    if not re.fullmatch(r"[\w-]+\.md", target):
        return label
    topic = Path(target).stem
    return f"{label} (`replay guide`)" if topic == INDEX_PAGE else f"{label} (`replay guide {topic}`)"
