"""The before/after page of ``replay fix``: true figures, both lanes, pictures of every body, nothing from outside."""

import re
from dataclasses import replace
from html import unescape
from io import StringIO
from itertools import pairwise

import numpy as np
import pytest
from msgspec import structs
from rich.console import Console
from support.shapes import box_mesh, revolved_mesh, shift_mesh

from cdcore import TriangleMesh
from replay.advice.collider_search import Limits
from replay.cli.console import People
from replay.cli.fix import fix_screen
from replay.document import columns
from replay.document.columns import screen_columns
from replay.document.tables import Column, text_of
from replay.running.collider_files import before_after_page, fix_colliders
from replay.show.fix_page import pictures
from replay.show.fix_page.page import BodyShape, body_card, comparison, cure_sentences, seam_line
from replay.show.fix_page.pictures import Shape, beyond_mesh, colour_numbers, reach_picture, scale_colour
from replay.show.fix_table import before_after_table, card_table
from replay.show.palette import SERIES_COLOURS
from sessions import MeshData, Session

pytestmark = pytest.mark.usefixtures("quickest_cutter_only")

WALL = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
ROD = [(0, 0), (0.003, 0), (0.003, 0.2), (0, 0.2)]
STEP_NS = 11_000_000


@pytest.fixture(scope="module")
def fix_of_stirred_cup():
    """A rod that stirs in a cup called like a script, free of its wall most of the time."""
    cup, rod = revolved_mesh(WALL, 12), revolved_mesh(ROD, 8)
    axis = int(np.argmax(np.ptp(cup.vertices, axis=0)))
    count, side = 60, (axis + 1) % 3
    positions = {name: np.zeros((count, 3)) for name in ("<b>cup", "rod", "spare")}
    positions["rod"][:, axis] = 0.05
    positions["rod"][:, side] = np.where(np.arange(count) % 15 < 3, 0.031, 0.001 * (np.arange(count) % 15))
    positions["spare"] += 2.0 + np.arange(count)[:, None] * 1e-3
    still = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    meshes = dict(zip(positions, (cup, rod, rod), strict=True))
    session = Session.from_arrays(
        np.arange(count) * STEP_NS,
        {name: (position, still) for name, position in positions.items()},
        {name: MeshData(mesh.vertices, mesh.faces) for name, mesh in meshes.items()},
    )
    return fix_colliders(session, limits=Limits(0.2))


@pytest.fixture(autouse=True, scope="module")
def small_pictures():
    """Pictures of bodies have 100 by 60 pixels: drawing took most of the time of a page."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "PICTURE_PIXELS", (100, 60))
        yield


@pytest.fixture(scope="module")
def page(fix_of_stirred_cup, small_pictures):
    """The before/after page of the fixed session."""
    return before_after_page(fix_of_stirred_cup)


def test_fix_page_headline_has_values_before_and_after(fix_of_stirred_cup, page):
    """A percentage before and after, and so many pieces in place of the three hulls of cup, rod and spare."""
    text = re.sub(r"<[^>]*>", "", re.search(r"<h1>(.*?)</h1>", page, re.S)[1])
    text = unescape(" ".join(text.split()))
    assert text == cure_sentences(fix_of_stirred_cup.result, fix_of_stirred_cup.before, fix_of_stirred_cup.after)
    assert re.search(rf"-> \d.* %.*; {fix_of_stirred_cup.after['pieces']} pieces in place of 3 hulls[;.]", text)


def test_page_has_both_lanes_and_both_stills(page):
    """One still of the same moment with hulls and with pieces, which report no contact there."""
    lanes = re.findall(r'<svg class="lane" data-detector="(\w+)"', page)
    assert lanes[:3] == ["exact", "hulls", "pieces"]
    pair = page[page.index('<div class="pair">') : page.index('<section class="compared">')]
    assert pair.count("data:image/webp") == 2 and "the pieces report none" in pair


def test_every_body_has_a_card_with_pictures(fix_of_stirred_cup, page):
    """The cup is cut and has four pictures; rod and spare keep their hulls and have one; nothing touches the spare."""
    cards = re.findall(r'<article class="card"><div class="pictures">(.*?)</article>', page, re.S)
    assert [card.count("data:image/webp") for card in cards] == [4, 1, 1]
    pieces = f"{fix_of_stirred_cup.after['pieces'] - 2} pieces: sectors by height and angle"
    assert f"&lt;b&gt;cup: {pieces}" in cards[0] and "<b>cup" not in page
    assert "beyond the mesh" in cards[0] and "rod: keeps its hull: it is convex" in cards[1]
    assert "nothing touches them" in page and "spare" in page[page.index('id="limits"') :]


def test_page_is_self_contained_and_names_no_run_folder(page):
    """Addresses are places on the page or data; a command to view would need a run folder."""
    assert not re.findall(r'(?:src|href)="(?!#|data:)[^"]*"', page)
    assert "replay view" not in page


@pytest.mark.slow
@pytest.mark.parametrize("fraction", [1.0, 0.6])
def test_fix_page_omits_milliseconds_measured_on_a_busy_machine(fix_of_stirred_cup, fraction):
    """``fraction``: of the processor that the detectors had; other programs had the other 40 %.

    Then a cost twice as large is not marked as worse either.
    """
    document = fix_of_stirred_cup.result.document
    detectors = {
        label: structs.replace(row, seconds=structs.replace(row.seconds, processor_fraction=fraction))
        for label, row in document.detectors.items()
    }
    result = replace(fix_of_stirred_cup.result, document=structs.replace(document, detectors=detectors))
    text = cure_sentences(result, fix_of_stirred_cup.before, fix_of_stirred_cup.after)
    assert ("ms a frame" in text) == (fraction == 1.0) and "False 80 % -> " in text
    if fraction < 1.0:
        assert "The machine was busy (40 %)" in before_after_page(replace(fix_of_stirred_cup, result=result))
    slower = fix_of_stirred_cup.after | {"ms": 2.0 * fix_of_stirred_cup.before["ms"]}
    figures = comparison(screen_columns("before_after"), fix_of_stirred_cup.before, slower, is_busy=fraction < 1.0)
    marks = {figure.name: figure.change for figure in figures}
    assert marks["mean ms"] == ("worse" if fraction == 1.0 else "")


@pytest.mark.parametrize(
    ("before", "after", "change"),
    [
        (2.0, 2.02, ""),
        (2.0, 2.03, "worse"),
        (2.0, 1.97, "better"),
        (0.0, 2.0, "worse"),
        (None, 2.0, ""),
        (2.0, None, ""),
    ],
)
def test_figure_changed_by_over_1_percent_is_marked(before, after, change):
    """Larger is worse for a gap; from 0 any growth counts, and nothing where one is unknown."""
    (figure,) = comparison([Column("gap", float)], {"gap": before}, {"gap": after}, is_busy=False)
    assert figure.change == change


def test_new_columns_of_a_fix_reach_terminal_and_page(fix_of_stirred_cup, monkeypatch):
    """A column with a cell of its own is added to each of three tables, and to nothing else."""
    tables = ("before_after", "pieces_front", "cards")
    for table in tables:
        probe = Column("probe", float, of=lambda row: 40.0, show=lambda value, table=table: f"cell of {table}")
        monkeypatch.setitem(columns.COLUMNS, table, (*columns.COLUMNS[table], probe))
    console = Console(width=400, file=StringIO())
    console.print(fix_screen(fix_of_stirred_cup, People(verbose=True)))
    for text in (console.file.getvalue(), before_after_page(fix_of_stirred_cup)):
        assert [table for table in tables if f"cell of {table}" not in text] == []


def test_page_compares_every_column_of_the_table_in_the_terminal(fix_of_stirred_cup, page):
    """The page has a line a column, with cells before and after the fix."""
    table = before_after_table(fix_of_stirred_cup.before, fix_of_stirred_cup.after, contacts=4, step_hz=50.0)
    compared = re.search(r'<section class="compared">.*?</table>', page, re.S)[0]
    assert re.findall(r'<th scope="row">(.*?)</th>', compared) == table.values().head
    cells = re.findall(r'<td class="n ?(?:\w*)">(.*?)</td>', compared)
    before, after = ([text_of(cell) for cell in row] for row in table.values().cells())
    assert list(zip(cells[::2], cells[1::2], strict=True)) == list(zip(before, after, strict=True))


def test_distance_beyond_a_box_is_that_of_its_surface():
    """The surface is at 0.5; a point inside is 0 beyond a closed box, and 0.2 from an open one."""
    box = box_mesh((1.0, 1.0, 1.0))
    points = np.array([[0.7, 0.013, 0.031], [0.1, 0.2, 0.3], [0.8, 0.9, 0.017], [0.013, -0.6, 0.2]])
    assert beyond_mesh(points, box) == pytest.approx([0.2, 0.0, 0.5, 0.1], abs=1e-9)
    open_box = TriangleMesh(box.vertices, box.faces[1:])
    assert beyond_mesh(points[1:2], open_box)[0] == pytest.approx(0.2, abs=1e-9)


def test_neighbouring_pieces_have_different_colours():
    """Twelve cubes in a row, each touching the next; more than two colours are used."""
    row = [shift_mesh(box_mesh((1.0, 1.0, 1.0)), (1.0 * k, 0.0, 0.0)) for k in range(12)]
    numbers = colour_numbers(row, len(SERIES_COLOURS))
    assert all(a != b for a, b in pairwise(numbers)) and len(set(numbers)) > 2


def test_pieces_on_both_sides_of_the_first_avoid_its_colour():
    """The second, distant piece has the other of two colours; it is free again for both neighbours of the first."""
    pieces = [shift_mesh(box_mesh((1.0, 1.0, 1.0)), (x, 0.0, 0.0)) for x in (0.0, 5.0, 1.0, -1.0)]
    assert colour_numbers(pieces, 2) == [0, 1, 1, 1]


def test_colour_scale_grows_lighter_and_is_never_red():
    """Lightness weighs red, green and blue as sRGB does."""
    colours = [scale_colour(fraction) for fraction in np.linspace(0, 1, 11)]
    lightness = [0.2126 * red + 0.7152 * green + 0.0722 * blue for red, green, blue in colours]
    assert lightness == sorted(lightness)
    assert all(green > 0.35 for _, green, _ in colours)


def test_seam_is_named_by_kind_width_pieces_and_place():
    """Pieces are counted from 0 in the data and from 1 for people; millimetres have one digit."""
    seam = {"kind": "slit", "pieces": [2, 6], "width_mm": 0.4, "at_mm": [12.0, -40.04, 3.0]}
    assert seam_line(seam) == "slit of 0.4 mm: pieces 3 and 7, at 12.0, -40.0, 3.0 mm"


def test_report_cards_list_the_hull_and_what_was_tried():
    """The cup is cut into 4 pieces; the rod keeps its hull, beside which a box was tried."""
    fractions = dict.fromkeys(("beyond", "missing", "false", "missed", "ms"))
    card = {**fractions, "triangles": 12, "reach_mm": 0.0, "overlap_mm": 0.0, "slit_mm": 0.0}
    hull, cut = {**card, "pieces": 1}, {**card, "pieces": 4}
    bodies = [
        {"body": "cup", "how": "planes", "before": hull, "after": cut, "others": []},
        {"body": "rod", "how": "hull", "before": hull, "after": hull, "others": [{**hull, "how": "box"}]},
    ]
    rows = [row[:3] for row in card_table(bodies).rows]
    assert rows == [("cup", "hull", 1), ("", "planes", 4), ("rod", "hull", 1), ("", "box", 1)]


def colours_of_reach(monkeypatch, mesh, pieces):
    """Colours of the picture of these pieces, whose scale ends at 50 mm."""
    colours = []
    monkeypatch.setattr(pictures, "Shape", lambda triangles, colour: colours.append(colour) or Shape(triangles, colour))
    reach_picture(mesh, pieces, largest_distance=0.05, alternative_text="pieces")
    return colours


@pytest.mark.slow
def test_farthest_piece_has_the_end_of_the_scale(monkeypatch):
    """A piece as large as the mesh has the colour of no distance, one 50 mm beyond it that of the farthest."""
    mesh = box_mesh((0.1, 0.1, 0.1))
    assert colours_of_reach(monkeypatch, mesh, [mesh]) == [scale_colour(0.0)]
    assert colours_of_reach(monkeypatch, mesh, [shift_mesh(mesh, (0.15, 0.0, 0.0))]) == [scale_colour(1.0)]


def test_piece_20_mm_beyond_has_the_nearest_of_24_colours(monkeypatch):
    """A triangle that lies 20 mm beside a box: 20/50 of the scale's 23 steps are 9.2."""
    triangle = TriangleMesh([[0.07, -0.01, -0.01], [0.07, 0.01, -0.01], [0.07, 0.0, 0.01]], [[0, 1, 2]])
    assert colours_of_reach(monkeypatch, box_mesh((0.1, 0.1, 0.1)), [triangle]) == [scale_colour(9 / 23)]


@pytest.mark.parametrize(
    ("pieces", "reason", "text"),
    [
        (1, "it is convex", "keeps its hull: it is convex"),
        (1, "", "keeps its hull"),
        (2, "it is convex", "2 pieces: planes"),
        (2, "", "2 pieces: planes"),
    ],
)
def test_card_states_why_a_body_keeps_its_hull(pieces, reason, text):
    """``pieces``: after the fix; a body in one piece has one picture and no figures after."""
    box = box_mesh((0.1, 0.1, 0.1))
    figures = dict.fromkeys(
        ("triangles", "beyond", "missing", "reach_mm", "overlap_mm", "slit_mm", "false", "missed", "ms"), 0.0
    )
    before, after = {**figures, "pieces": 1}, {**figures, "pieces": pieces, "seams": []}
    row = {"body": "cup", "how": "planes", "reason": reason, "before": before, "after": after}
    card = body_card(row, BodyShape(box, [box], [box] * pieces), busy=False)
    assert card.what == text and card.farthest == "" and len(card.pictures) == pieces
    assert card.after == ("pieces" if pieces > 1 else "") and all((f.after != "") == (pieces > 1) for f in card.figures)
