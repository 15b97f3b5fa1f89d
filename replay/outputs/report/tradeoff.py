"""A tradeoff in page and folder: wrong contacts against time as a picture, the advice, and a row per setting."""

import base64
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from replay.outputs.price_plot import subtitle
from replay.outputs.report.drawing import DARK, LIGHT, Theme
from replay.outputs.report.markup import Markup, Part, element, listed
from replay.outputs.report.tradeoff_picture import growth_picture, picture
from replay.outputs.results.parquet import write_rows
from replay.outputs.tradeoff_table import growth_table, how_measured, slow_frames, tradeoff_table
from replay.outputs.words import counted
from replay.pipeline.run_result import Tradeoff

TABLE: Final = "tradeoff.parquet"
GROWTH: Final = "growth.png"
JSON: Final = "tradeoff.json"
PICTURES: Final = {
    "tradeoff.png": ("png", LIGHT), "tradeoff.svg": ("svg", LIGHT), "tradeoff-dark.png": ("png", DARK),
}  # fmt: skip


def write_tradeoff(done: Tradeoff, folder: Path) -> None:
    """Write table and pictures into a folder; counters as a JSON text: every algorithm counts something else."""
    write_rows(({**row, "work": json.dumps(row["work"], sort_keys=True)} for row in done.rows), folder / TABLE)
    text = json.dumps(done.as_json(), indent=1, allow_nan=False)
    (folder / JSON).write_text(text + "\n", encoding="utf-8", newline="\n")
    for name, (kind, theme) in PICTURES.items():
        (folder / name).write_bytes(picture(done, kind, theme))
    if done.growth:
        (folder / GROWTH).write_bytes(growth_picture(done.growth))


@contextmanager
def tradeoff_files(done: Tradeoff) -> Iterator[dict[str, Path]]:
    """Name -> file, as ``write_run_folder`` takes further files; they are gone when the block ends."""
    with TemporaryDirectory() as folder:
        write_tradeoff(done, Path(folder))
        yield {path.name: path for path in sorted(Path(folder).iterdir())}


def tradeoff_parts(done: Tradeoff) -> Iterator[Part]:
    """Advice, picture and table; the picture is SVG inside the page, for light pages and for dark ones."""
    yield listed(done.advice)
    dark = element("source", srcset=_drawn(done, DARK), media="(prefers-color-scheme: dark)")
    light = element("img", src=_drawn(done, LIGHT), alt=done.answer, style="width:100%")
    image = element("picture", Markup(dark.removesuffix("</source>")), Markup(light.removesuffix("</img>")))
    yield element("figure", image, tabindex=0)
    if done.cut:
        count = f"{counted(len(done.cut), 'setting')} not tried, for want of time"
        yield element("details", element("summary", count), element("p", f"{', '.join(done.cut)}."))
    yield listed((*subtitle(done), *slow_frames(done.rows), *how_measured(done)))
    yield tradeoff_table("Every setting that was tried", done.rows)
    if done.growth:
        yield growth_table(done.growth)


def _drawn(done: Tradeoff, theme: Theme) -> str:
    drawn = base64.b64encode(picture(done, "svg", theme, beside_words=True)).decode("ascii")
    return f"data:image/svg+xml;base64,{drawn}"
