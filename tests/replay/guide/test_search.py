"""The words of a reader lead to the section that answers; comments of code and pieces of words lead nowhere."""

import pytest

from replay.guide.pages import INDEX_PAGE, page, topics
from replay.guide.search import Level, near_terms, query_terms, search, sections_of

GUIDE = [section for topic in topics() for section in sections_of(topic, page(topic))]

ANSWERS = [
    ("UNRESOLVED", "glossary", "Verdicts"),
    ("missed", "glossary", "Answers"),
    ("late", "glossary", "Answers"),
    ("sample", "glossary", "Answers"),
    ("front", "glossary", "Answers"),
    ("tau", "hard-cases", "Hard cases"),
    ("hand", "results", "Real hands: people who drink"),
    ("real-hands", "results", "Real hands: people who drink"),
    ("tracked-hands", "your-recording", "Tracked hands"),
    ("joints", "your-recording", "Tracked hands"),
    ("openxr", "your-recording", "Tracked hands"),
    ("mjcf", "your-recording", "Other formats"),
    ("mcap", "your-recording", "Other formats"),
    ("urdf", "scenes-and-effects", "A scene"),
    ("colliders", "what-to-ship", "Colliders to ship"),
    ("fix", "what-to-ship", "Colliders to ship"),
    ("godot colliders", "what-to-ship", "Colliders to ship"),
    ("godot", "your-recording", "From Unreal, Godot or any CSV"),
    ("import", "your-recording", "From Unreal, Godot or any CSV"),
    ("unity csv", "your-recording", "From Unity"),
    ("doctor", "your-recording", "Can you trust the recording?"),
    ("how do i undo my answers", "your-recording", "Can you trust the recording?"),
    ("cost", "what-to-ship", "What accuracy costs"),
    ("times", "what-to-ship", "How the times are taken"),
    ("timing", "files-and-promises", "The run folder"),
    ("ship", "what-to-ship", "What to ship"),
    ("pour", "scenes-and-effects", "Effects: only what a scene declares"),
    ("solutes", "scenes-and-effects", "Which chemistry is modelled"),
    ("temperature_c", "scenes-and-effects", "Which chemistry is modelled"),
    ("answer", "what-is-wrong", "Read the answer"),
    ("noise", "what-is-wrong", "Which answers noise can change"),
    ("sql", "many-sessions", "Query all runs in SQL"),
    ("exit code", "in-a-build", "Exit codes"),
    ("personal", "files-and-promises", "Personal data in each output"),
    ("verdict", "glossary", "Verdicts"),
    ("unity csv quaternion w first", "your-recording", "From Unreal, Godot or any CSV"),
    ("ci fail missed contact deeper 2 mm", "in-a-build", "In a build (CI): a test of every change"),
    ("how many convex pieces mug godot file", "what-to-ship", "Colliders to ship"),
    ("recording stopped damaged file recover", "files-and-promises", "When something goes wrong"),
    ("my python detector test hard cases compare", "hard-cases", "Hard cases"),
    ("late or cut short", "glossary", "Answers"),
    ("sessions S3 four machines sql", "many-sessions", "On a cluster"),
    ("declare phenolphthalein pink titration", "scenes-and-effects", "A titration from nothing"),
    ("mesh lies on its side which axis is up", "your-recording", "Axes of meshes"),
    ("pre-test scores Excel CSV", "class-study", "A class: what students did, and what they answered"),
    ("SteamVR crashed rescue file", "your-recording", "Can you trust the recording?"),
    ("compatibility", "files-and-promises", "Between versions"),
    ("compare colliders before after", "what-is-wrong", "Before and after a change"),
    ("class", "class-study", "A class: what students did, and what they answered"),
]


def test_queries_of_readers_lead_to_the_section():
    """A row of ``ANSWERS`` is a query of words, and page (topic) and heading of the section that must come first."""
    for query, topic, heading in ANSWERS:
        best, *_ = search(query.split(), GUIDE)
        assert (best.section.topic, best.section.heading) == (topic, heading), query


def headings(query, text):
    """Headings of the sections of a page (Markdown) that a query finds, best first."""
    return [match.section.heading for match in search(query.split(), sections_of("page", text))]


PAGE_WITH_A_LINK = "# Title\n\ncross [loss](https://a.b/target) ![drawn](picture.png) <!-- mark -->\n"


PAGE_ABOUT_CUPS = """# Title

prose of a Cup

## Prose
cup, cup and cup

## Cells
| head cup | other |
|---|---|
| cups | 1 |

## The cups
text
"""


def test_heading_comes_before_term_and_term_before_prose():
    """Four sections of a page have the word "cup": in the heading, as the first cell of a row, and in prose.

    In prose it stands three times in one section, once in the other. Capitals and a last s do not count.
    """
    assert headings("cup", PAGE_ABOUT_CUPS) == ["The cups", "Cells", "Prose", "Title"]


@pytest.mark.parametrize("language", ["bash", "toml", "python", "yaml", ""])
def test_a_comment_of_code_neither_matches_nor_begins_a_section(language):
    """A block of code with two comments, one of them at the begin of a line, where "#" would begin a heading.

    Other words of the block, and the text after it, belong to the section before.
    """
    text = f"# Title\n\n```{language}\n# a comment\nrun it  # beside it\n```\n\nafter\n"
    assert headings("comment", text) == headings("beside", text) == []
    assert headings("run", text) == headings("after", text) == ["Title"]


@pytest.mark.parametrize(
    "query",
    [
        pytest.param("oss", id="piece of a word"),
        pytest.param("target", id="address of a link"),
        pytest.param("picture", id="address of a picture"),
        pytest.param("mark", id="comment"),
    ],
)
def test_fragments_addresses_and_comments_match_nothing(query):
    """The page has a link, "[loss](https://a.b/target)", a picture and a comment."""
    assert headings(query, PAGE_WITH_A_LINK) == []


def test_text_of_a_link_matches_in_any_case():
    """The page has a link, "[loss](https://a.b/target)"."""
    assert headings("LOSS", PAGE_WITH_A_LINK) == ["Title"]


def test_a_section_with_more_terms_comes_first():
    """One section has "unity" as its heading, the other has "csv" and "unity" in its prose.

    A word that no section has ("nonsense") counts for none.
    """
    text = "# Title\n\n## Unity\ntext\n## Other\na csv for unity\n"
    best, *_ = headings("unity csv", text)
    assert best == "Other"
    assert headings("unity nonsense", text) == ["Unity", "Other"]


def test_guide_search_ranks_rare_terms_above_common_terms():
    """Three sections have "cup", a single one has "phenolphthalein": that leads, and says which word it lacks."""
    text = "# Title\n\n## Cup\ncup\n## Cups\ncup\n## More\na cup\n## Rare\nphenolphthalein\n"
    best, *_ = search(["cup", "phenolphthalein"], sections_of("page", text))
    assert best.section.heading == "Rare"
    assert best.missing == ("cup",)


def test_near_terms_are_spelled_like_the_query():
    """For a word that no section has, words of the guide that are spelled alike are suggested; for "qqqqqq" none.

    Suggested are no numbers and no pieces of words.
    """
    assert "glossary" in near_terms("glosary", sections_of("page", "# The glossary\n"))
    assert near_terms("qqqqqq", GUIDE) == []
    sections = sections_of("page", "# Title\n\ncup cu cup2\n")
    assert near_terms("cup3", sections) == ["cup"]
    assert near_terms("cu", sections) == ["cup"]


def test_fillers_count_only_in_a_query_of_fillers():
    """The filler "how" is left out beside other words, which count once and in small letters; alone it is the query."""
    assert query_terms(["how", "undo", "Undo", "answers"]) == ["undo", "answers"]
    assert query_terms(["how"]) == ["how"]


def test_term_has_the_highest_level_at_which_it_occurs():
    """Words of a section, from the best level on: heading; bold, code or first cell by itself; part of such; prose.

    A shell command is a longer term, other code is prose.
    """
    text = (
        "# Title\n\nprose **bold** `code` **two words**\n```bash\nreplay run\n```\n```toml\nkind = 1\n```\n"
        "\n| head | head |\n|---|---|\n| cell, other | text |\n"
    )
    (section,) = sections_of("page", text)
    expected = {
        "title": Level.HEADING,
        **dict.fromkeys(("bold", "code", "cell", "other"), Level.TERM),
        **dict.fromkeys(("two", "run"), Level.IN_TERM),
        "kind": Level.PROSE,
    }
    assert {word: section.levels[word] for word in expected} == expected


def test_section_is_printed_under_the_title_of_its_page():
    """A page with a title and a section "Part"; what stands before that is a section too."""
    first, second = sections_of("page", "# Title\n\ntext\n\n## Part\nmore\n")
    assert first.page == "# Title\n\ntext\n"
    assert second.page == "# Title\n\n## Part\nmore\n"


@pytest.mark.sampled(13)
@pytest.mark.parametrize("topic", [INDEX_PAGE, *topics()])
def test_sections_of_a_page_are_the_page(topic):
    """All lines of a page of the guide, in order, but empty ones and those that begin a comment of Markdown."""
    lines_of_sections = [line for section in sections_of(topic, page(topic)) for line in section.text.splitlines()]
    lines_of_page = [line for line in page(topic).splitlines() if not line.startswith("<!--")]
    assert [line for line in lines_of_sections if line] == [line for line in lines_of_page if line]
