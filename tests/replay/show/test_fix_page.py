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
from replay.cutting import piece_store
from replay.cutting.methods import METHODS
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


class EndedProcess:
    """A process that ended without an error, as ``subprocess`` describes it."""

    returncode = 0

    def poll(self):
        return self.returncode

    def wait(self, _seconds):
        return self.returncode


@pytest.fixture(scope="module")
def cut_in_this_process():
    """The program that cuts a mesh runs here: a process of its own would import the tool again."""

    def cut_here(cut, folder):
        ladder = METHODS[cut.name].cut(cut.mesh, cut.most)
        np.savez(folder / f"{cut.key}.out.npz", corners=ladder.corners, ends=ladder.ends, joins=ladder.joins)
        return EndedProcess()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(piece_store, "_start_cutting", cut_here)
        yield


@pytest.fixture(scope="module")
def fix_of_stirred_cup(cut_in_this_process):
    """Pieces for a rod that stirs in a cup called like a script, 60 frames; a spare rod is 2 m away.

    The rod is at the cup's wall in 3 of 15 frames, else free in the hollow, which the hull of the cup fills.
    """
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
    return fix_colliders(session, limits=Limits(false=0.2))


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
    """The headline is the sentence of the fix: a fraction of false contact before and after, and the pieces.

    Before, each of cup, rod and spare rod had one hull.
    """
    headline = re.search(r"<h1>(.*?)</h1>", page, re.DOTALL)[1]
    text = unescape(" ".join(re.sub(r"<[^>]*>", "", headline).split()))
    assert text == cure_sentences(fix_of_stirred_cup.result, fix_of_stirred_cup.before, fix_of_stirred_cup.after)
    assert re.search(rf"-> \d.* %.*; {fix_of_stirred_cup.after['pieces']} pieces in place of 3 hulls[;.]", text)


def test_page_has_both_lanes_and_both_stills(page):
    """Lanes over time: the reference, the hulls before the fix, the pieces after it.

    Two still pictures of one moment, with hulls and with pieces: a false contact of the hulls that pieces lack.
    """
    lanes = re.findall(r'<svg class="lane" data-detector="(\w+)"', page)
    assert lanes[:3] == ["exact", "hulls", "pieces"]
    both_pictures = page[page.index('<div class="pair">') : page.index('<section class="compared">')]
    assert both_pictures.count("data:image/webp") == 2
    assert "hulls report contact of" in both_pictures
    assert "the pieces report none" in both_pictures


def test_every_body_has_a_card_with_pictures(fix_of_stirred_cup, page):
    """The cup ("<b>cup", escaped in the page) is cut: mesh, pieces, and how far the hull and the pieces reach out.

    The rod and the spare rod are convex, keep one hull each, and have a picture of the mesh only.
    """
    cards = re.findall(r'<article class="card"><div class="pictures">(.*?)</article>', page, re.DOTALL)
    cup_card, rod_card, spare_card = cards
    assert [card.count("data:image/webp") for card in (cup_card, rod_card, spare_card)] == [4, 1, 1]
    cup_pieces = fix_of_stirred_cup.after["pieces"] - 2
    assert f"&lt;b&gt;cup: {cup_pieces} pieces: sectors by height and angle" in cup_card
    assert "<b>cup" not in page
    assert "beyond the mesh" in cup_card
    assert "rod: keeps its hull: it is convex" in rod_card


def test_body_without_contact_is_listed_among_the_limits(page):
    """The spare rod, 2 m away, touches nothing in the recording: nothing is known about its hull."""
    limits = page[page.index('id="limits"') :]
    assert re.search(r"nothing touches them[^<]*: spare\.", limits)


def test_page_is_self_contained_and_names_no_run_folder(page):
    """Every address is a place on the page (#...) or data; ``replay view`` would need the folder of a run."""
    addresses = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert addresses
    assert [address for address in addresses if not address.startswith(("#", "data:"))] == []
    assert "replay view" not in page


def with_processor_fraction(result, fraction):
    """The result as if each of its detectors had had this fraction of the processor while it was timed."""
    detectors = {
        label: structs.replace(row, seconds=structs.replace(row.seconds, processor_fraction=fraction))
        for label, row in result.document.detectors.items()
    }
    return replace(result, document=structs.replace(result.document, detectors=detectors))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("processor_fraction", "is_busy"), [pytest.param(1.0, False, id="idle"), pytest.param(0.6, True, id="busy")]
)
def test_fix_page_omits_milliseconds_measured_on_a_busy_machine(fix_of_stirred_cup, processor_fraction, is_busy):
    """Other programs had 40 % of a busy machine: its milliseconds are not in the headline, and twice as many no worse.

    The rod touches in 12 of 60 frames, and the hulls report all 60: 80 % false, on any machine.
    """
    before, after = fix_of_stirred_cup.before, fix_of_stirred_cup.after
    result = with_processor_fraction(fix_of_stirred_cup.result, processor_fraction)
    headline = cure_sentences(result, before, after)
    assert "False 80 % -> " in headline
    assert ("ms a frame" in headline) == (not is_busy)
    if is_busy:
        assert "The machine was busy (40 %)" in before_after_page(replace(fix_of_stirred_cup, result=result))
    twice_as_slow = after | {"ms": 2.0 * before["ms"]}
    figures = comparison(screen_columns("before_after"), before, twice_as_slow, is_busy=is_busy)
    marks = {figure.name: figure.change for figure in figures}
    assert marks["mean ms"] == ("" if is_busy else "worse")


def test_figure_changed_by_over_1_percent_is_marked():
    """A gap, of which more is worse, by over 1 % of the larger of both; without a value before or after: no mark."""
    rows = {
        "0.99 % of the larger": (2.0, 2.02, ""),
        "1.48 % more": (2.0, 2.03, "worse"),
        "1.5 % less": (2.0, 1.97, "better"),
        "from nothing": (0.0, 2.0, "worse"),
        "unknown before": (None, 2.0, ""),
        "unknown after": (2.0, None, ""),
    }
    for row, (before, after, mark) in rows.items():
        (figure,) = comparison([Column("gap", float)], {"gap": before}, {"gap": after}, is_busy=False)
        assert figure.change == mark, row


def test_new_columns_of_a_fix_reach_terminal_and_page(fix_of_stirred_cup, monkeypatch):
    """A column whose cells name the table is added to the list of columns of each of the three tables of a fix.

    Both outputs show its cells without a change of their own.
    """
    tables = ("before_after", "pieces_front", "cards")
    for table in tables:
        new_column = Column(
            "new", float, of=lambda row: 40.0, show=lambda value, table=table: f"cell of {table}"
        )  # any number
        monkeypatch.setitem(columns.COLUMNS, table, (*columns.COLUMNS[table], new_column))
    console = Console(width=400, file=StringIO())  # wide enough for every column
    console.print(fix_screen(fix_of_stirred_cup, People(verbose=True)))
    for text in (console.file.getvalue(), before_after_page(fix_of_stirred_cup)):
        assert [table for table in tables if f"cell of {table}" not in text] == []


def test_page_compares_every_column_of_the_table_in_the_terminal(fix_of_stirred_cup, page):
    """The terminal has a row before and one after the fix; the page has a line a column with the same two cells."""
    any_title = {"contacts": 4, "step_hz": 50.0}  # both stand in the title alone
    terminal_table = before_after_table(fix_of_stirred_cup.before, fix_of_stirred_cup.after, **any_title).values()
    row_before, row_after = ([text_of(cell) for cell in row] for row in terminal_table.cells())
    compared = re.search(r'<section class="compared">.*?</table>', page, re.DOTALL)[0]
    names = re.findall(r'<th scope="row">(.*?)</th>', compared)
    cells = re.findall(r'<td class="n ?(?:\w*)">(.*?)</td>', compared)
    cells_before, cells_after = cells[::2], cells[1::2]
    assert names == terminal_table.head
    assert (cells_before, cells_after) == (row_before, row_after)


def test_distance_beyond_a_box_is_that_of_its_surface():
    """A closed cube of side 1 about the origin, its surface at 0.5: a point at x = 0.7 is 0.2 beyond it.

    Odd coordinates keep rays through the points off edges of the mesh.
    """
    cube = box_mesh((1.0, 1.0, 1.0))
    distance_beyond = {
        (0.7, 0.013, 0.031): 0.2,
        (0.1, 0.2, 0.3): 0.0,  # inside
        (0.8, 0.9, 0.017): 0.5,  # from the edge: hypot(0.3, 0.4)
        (0.013, -0.6, 0.2): 0.1,
    }
    distances = beyond_mesh(np.array([*distance_beyond]), cube)
    assert distances == pytest.approx([*distance_beyond.values()], abs=1e-9)


def test_points_within_an_open_mesh_are_beyond_it():
    """A cube of side 1 that lacks a triangle has no inside: 0.3 is 0.2 from the nearest side, at 0.5."""
    cube = box_mesh((1.0, 1.0, 1.0))
    open_cube = TriangleMesh(cube.vertices, cube.faces[1:])
    assert beyond_mesh(np.array([[0.1, 0.2, 0.3]]), open_cube) == pytest.approx([0.2], abs=1e-9)


def test_neighbouring_pieces_have_different_colours():
    """Twelve unit cubes in a row, 1 apart: each touches the next. More than two colours of the palette are used."""
    row = [shift_mesh(box_mesh((1.0, 1.0, 1.0)), (1.0 * k, 0.0, 0.0)) for k in range(12)]
    numbers = colour_numbers(row, len(SERIES_COLOURS))
    assert all(colour != next_colour for colour, next_colour in pairwise(numbers))
    assert len(set(numbers)) > 2


def test_pieces_on_both_sides_of_the_first_avoid_its_colour():
    """Unit cubes at x = 0, 5, 1 and -1, and two colours: the third and the fourth touch the first, the second none.

    The second has the colour that is used least, 1; it touches neither neighbour of the first, so they may have it too.
    """
    pieces = [shift_mesh(box_mesh((1.0, 1.0, 1.0)), (x, 0.0, 0.0)) for x in (0.0, 5.0, 1.0, -1.0)]
    assert colour_numbers(pieces, colours=2) == [0, 1, 1, 1]


def test_colour_scale_grows_lighter_and_is_never_red():
    """Eleven colours from 0 to the farthest distance, in red, green and blue from 0 to 1.

    Lightness weighs the three as sRGB does; a colour with that much green is a blue, a grey or a yellow.
    """
    colours = [scale_colour(fraction) for fraction in np.linspace(0, 1, 11)]
    lightness = [0.2126 * red + 0.7152 * green + 0.0722 * blue for red, green, blue in colours]
    least_green = 0.35
    assert lightness == sorted(lightness)
    assert all(green > least_green for _, green, _ in colours)


def test_seam_is_named_by_kind_width_pieces_and_position():
    """Pieces 2 and 6 of the data, which counts from 0, are 3 and 7 for people; coordinates in mm have one digit."""
    seam = {"kind": "slit", "pieces": [2, 6], "width_mm": 0.4, "at_mm": [12.0, -40.04, 3.0]}
    assert seam_line(seam) == "slit of 0.4 mm: pieces 3 and 7, at 12.0, -40.0, 3.0 mm"


def test_report_cards_list_the_hull_and_what_was_tried():
    """Rows are (body, collider, pieces). The cup is cut by planes into 4 pieces: a row for its hull and one for these.

    The rod keeps its hull, so that has no second row; a box in its place was tried.
    """
    unmeasured = dict.fromkeys(("beyond", "missing", "false", "missed", "ms"))
    figures = {**unmeasured, "triangles": 12, "reach_mm": 0.0, "overlap_mm": 0.0, "slit_mm": 0.0}  # not of interest
    hull, cut = {**figures, "pieces": 1}, {**figures, "pieces": 4}
    bodies = [
        {"body": "cup", "how": "planes", "before": hull, "after": cut, "others": []},
        {"body": "rod", "how": "hull", "before": hull, "after": hull, "others": [{**hull, "how": "box"}]},
    ]
    rows = [(body, collider, pieces) for body, collider, pieces, *_ in card_table(bodies).rows]
    assert rows == [("cup", "hull", 1), ("", "planes", 4), ("rod", "hull", 1), ("", "box", 1)]


def colours_of_reach(monkeypatch, mesh, pieces):
    """Colours in the picture of how far these pieces reach beyond the mesh; its scale ends at 50 mm."""
    colours = []
    monkeypatch.setattr(pictures, "Shape", lambda triangles, colour: colours.append(colour) or Shape(triangles, colour))
    reach_picture(mesh, pieces, largest_distance=0.05, alternative_text="pieces")
    return colours


@pytest.mark.slow
def test_farthest_piece_has_the_end_of_the_scale(monkeypatch):
    """The scale of colours goes from 0 to 50 mm beyond the mesh, a cube of 10 cm.

    A piece equal to the mesh is 0 beyond it; moved by 15 cm, all of it is at least 50 mm away.
    """
    mesh = box_mesh((0.1, 0.1, 0.1))
    distant = shift_mesh(mesh, (0.15, 0.0, 0.0))
    assert colours_of_reach(monkeypatch, mesh, [mesh]) == [scale_colour(0.0)]
    assert colours_of_reach(monkeypatch, mesh, [distant]) == [scale_colour(1.0)]


def test_piece_20_mm_beyond_has_the_nearest_of_24_colours(monkeypatch):
    """The side of a cube of 10 cm is at x = 50 mm, a triangle at 70 mm; the scale of colours ends at 50 mm.

    20 mm are 0.4 of the scale, which is 9.2 of the 23 steps between 24 colours: the nearest is number 9.
    """
    triangle = TriangleMesh([[0.07, -0.01, -0.01], [0.07, 0.01, -0.01], [0.07, 0.0, 0.01]], [[0, 1, 2]])
    assert colours_of_reach(monkeypatch, box_mesh((0.1, 0.1, 0.1)), [triangle]) == [scale_colour(9 / 23)]


def test_card_states_why_a_body_keeps_its_hull():
    """A cube of 10 cm that is as it was, in one piece, or cut by planes into two, each drawn as the whole cube.

    A cut body has a second picture, of the pieces, and its figures after the cut; none reaches beyond the mesh.
    """
    rows = {
        "hull, with a reason": (1, "it is convex", "keeps its hull: it is convex"),
        "hull, without a reason": (1, "", "keeps its hull"),
        "pieces, reason ignored": (2, "it is convex", "2 pieces: planes"),
        "pieces": (2, "", "2 pieces: planes"),
    }
    for row, (pieces, reason, text) in rows.items():
        box = box_mesh((0.1, 0.1, 0.1))
        figure_names = ("triangles", "beyond", "missing", "reach_mm", "overlap_mm", "slit_mm", "false", "missed", "ms")
        figures = dict.fromkeys(figure_names, 0.0)
        before, after = {**figures, "pieces": 1}, {**figures, "pieces": pieces, "seams": []}
        card_row = {"body": "cup", "how": "planes", "reason": reason, "before": before, "after": after}
        card = body_card(card_row, BodyShape(mesh=box, before=[box], after=[box] * pieces), busy=False)
        is_cut = pieces > 1
        assert (card.what, card.farthest) == (text, ""), row
        assert len(card.pictures) == (2 if is_cut else 1), row
        assert card.after == ("pieces" if is_cut else ""), row
        assert all((figure.after != "") == is_cut for figure in card.figures), row
