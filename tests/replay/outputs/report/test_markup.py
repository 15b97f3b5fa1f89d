import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.page_cells import Cells
from support.small_tables import made

from replay.outputs.report.markup import Markup, element, page_table, picture, safe, table


@given(st.text())
def test_no_text_becomes_an_element(text):
    assert "<" not in safe(text) and "<" not in element("p", text)[3:-4]
    assert element("p", "x", title=text).count('"') == 2


def test_markup_is_put_in_as_it_is():
    assert element("p", element("b", "<"), class_="x", aria_label="y") == '<p class="x" aria-label="y"><b>&lt;</b></p>'
    assert isinstance(element("p"), Markup)


def test_numbers_stand_right_and_words_left():
    text = table("c", ("a", "b"), [("x", 1)], words=1)
    assert '<td class="word">x</td><td class="number">1</td>' in text
    with pytest.raises(ValueError, match="zip"):
        table("c", ("a", "b"), [("x",)])


def test_a_picture_lies_in_the_page_and_says_what_it_shows():
    text = picture(b"abc", 'a "b"')
    assert 'src="data:image/png;base64,YWJj"' in text and 'alt="a &quot;b&quot;"' in text


def test_a_page_keeps_numbers_plain():
    text = page_table(made(words=("body",)))
    assert Cells(text).tables == {"a title": [["cup|lid", "1234", "7"], ["rod", "0", "x\nwhy"]]}
    assert "<b>7</b>" in text and "<code>x</code>" in text and "<p>a note</p>" in text
    assert '<td class="word">rod</td><td class="number">0</td>' in text
