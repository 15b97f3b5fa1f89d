from replay.outputs.report.drawing import INK, PAPER, svg_in_page


def drawn(axes):
    axes.plot([0, 1], [1, 2], color="#4a86c5", marker="o", mfc=PAPER, label="one")
    axes.axhline(1.5, color=INK)
    axes.set_xlabel("seconds")
    axes.legend()
    axes.grid(True)


def test_words_and_axes_have_the_ink_of_the_page_and_nothing_is_black_or_white():
    text = svg_in_page(4, 2, "a < b", drawn).lower()
    assert text.count("currentcolor") > 10 and "var(--paper)" in text and "#4a86c5" in text
    assert not any(colour in text for colour in ("#000000", "#ffffff", INK, PAPER))
    assert text.startswith('<svg role="img" aria-label="a &lt; b"')


def test_there_is_no_card_behind_a_plot():
    text = svg_in_page(4, 2, "", lambda axes: None)
    before_the_axes = text[: text.index('id="matplotlib.axis')]
    assert "fill: none" in before_the_axes and "fill: var(--paper)" not in before_the_axes


def test_one_drawing_gives_one_text():
    assert svg_in_page(4, 2, "", drawn) == svg_in_page(4, 2, "", drawn)
