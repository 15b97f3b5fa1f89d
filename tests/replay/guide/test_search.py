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
    for query, topic, heading in ANSWERS:
        best = search(query.split(), GUIDE)[0].section
        assert (best.topic, best.heading) == (topic, heading), query


def headings(query, text):
    """Headings of the sections that a query finds, best first."""
    return [match.section.heading for match in search(query.split(), sections_of("page", text))]


RANKED = """# Title

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
    assert headings("cup", RANKED) == ["The cups", "Cells", "Prose", "Title"]


@pytest.mark.parametrize("language", ["bash", "toml", "python", "yaml", ""])
def test_a_comment_of_code_neither_matches_nor_begins_a_section(language):
    text = f"# Title\n\n```{language}\n# a comment\nrun it  # beside it\n```\n\nafter\n"
    assert headings("comment", text) == headings("beside", text) == []
    assert headings("run", text) == headings("after", text) == ["Title"]


def test_only_whole_terms_match_and_targets_of_links_never():
    text = "# Title\n\ncross [loss](https://a.b/target) ![drawn](picture.png) <!-- mark -->\n"
    assert [headings(word, text) for word in ("oss", "target", "picture", "mark")] == [[]] * 4
    assert headings("LOSS", text) == ["Title"]


def test_a_section_with_more_terms_comes_first():
    text = "# Title\n\n## Unity\ntext\n## Other\na csv for unity\n"
    assert headings("unity csv", text)[0] == "Other"
    assert headings("unity nonsense", text) == ["Unity", "Other"]


def test_guide_search_ranks_rare_terms_above_common_terms():
    text = "# Title\n\n## Cup\ncup\n## Cups\ncup\n## More\na cup\n## Rare\nphenolphthalein\n"
    (best, *_) = search(["cup", "phenolphthalein"], sections_of("page", text))
    assert best.section.heading == "Rare" and best.missing == ("cup",)


def test_near_terms_are_spelled_like_the_query():
    assert "glossary" in near_terms("glosary", sections_of("page", "# The glossary\n"))
    assert near_terms("qqqqqq", GUIDE) == []
    sections = sections_of("page", "# Title\n\ncup cu cup2\n")
    assert near_terms("cup3", sections) == near_terms("cu", sections) == ["cup"], "no numbers, and no pieces of words"


def test_fillers_count_only_in_a_query_of_fillers():
    assert query_terms(["how", "undo", "Undo", "answers"]) == ["undo", "answers"]
    assert query_terms(["how"]) == ["how"]


def test_term_has_the_highest_level_at_which_it_occurs():
    text = (
        "# Title\n\nprose **bold** `code` **two words**\n```bash\nreplay run\n```\n```toml\nkind = 1\n```\n"
        "\n| head | head |\n|---|---|\n| cell, other | text |\n"
    )
    (section,) = sections_of("page", text)
    levels = {word: section.levels[word] for word in ("title", "bold", "code", "cell", "other", "two", "run", "kind")}
    assert levels == {
        "title": Level.HEADING,
        **dict.fromkeys(("bold", "code", "cell", "other"), Level.TERM),
        **dict.fromkeys(("two", "run"), Level.IN_TERM),
        "kind": Level.PROSE,
    }


def test_section_is_printed_under_the_title_of_its_page():
    first, second = sections_of("page", "# Title\n\ntext\n\n## Part\nmore\n")
    assert first.page == "# Title\n\ntext\n"
    assert second.page == "# Title\n\n## Part\nmore\n"


@pytest.mark.sampled(13)
@pytest.mark.parametrize("topic", [INDEX_PAGE, *topics()])
def test_sections_of_a_page_are_the_page(topic):
    lines = [line for section in sections_of(topic, page(topic)) for line in section.text.splitlines() if line]
    assert lines == [line for line in page(topic).splitlines() if line and not line.startswith("<!--")]
