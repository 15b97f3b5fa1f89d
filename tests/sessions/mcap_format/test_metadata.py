import pytest

from sessions.errors import SessionFileError
from sessions.mcap_format import metadata as module
from sessions.mcap_format.metadata import bodies_record, metadata_of, migrated, names_of, session_record


def test_facts_and_hashes_come_back_from_their_record():
    record = session_record({"vr_type": "augmented", "own": "word", "format": "old"}, {"a/b": "00ff"})
    facts, hashes = metadata_of(record)
    assert hashes == {"a/b": "00ff"}
    assert facts["vr_type"] == "augmented" and facts["own"] == "word" and facts["format"] == "vrlab/1"
    assert facts["consent"] == "not stated"
    assert session_record(facts, hashes) == record


def test_names_of_any_kind_come_back_in_order():
    names = ("b", "a", 'quote " and \\', "ä/ö", "")
    assert names_of(bodies_record(names)) == names


@pytest.mark.parametrize("text", ["", "{}", '["a", "a"]', "[1]", "[", "null"])
def test_a_damaged_list_of_names_is_one_sentence(text):
    with pytest.raises(SessionFileError, match="does not list different names"):
        names_of({"names": text})


def test_a_list_of_names_is_bounded():
    with pytest.raises(SessionFileError, match="4097 bodies"):
        names_of(bodies_record(tuple(map(str, range(4097)))))


def test_a_file_of_an_older_version_takes_every_step_to_today(monkeypatch):
    monkeypatch.setattr(module, "VERSION", 3)
    monkeypatch.setattr(module, "MIGRATIONS", {1: lambda r: r | {"one": "1"}, 2: lambda r: r | {"two": r["one"]}})
    assert migrated({}, "vrlab/1") == {"one": "1", "two": "1"}
    assert migrated({}, "vrlab/3") == {}
    for unknown in ("vrlab/0", "vrlab/4"):
        with pytest.raises(SessionFileError, match=unknown):
            migrated({}, unknown)


@pytest.mark.parametrize("profile", ["vrlab/", "vrlab/1.0", "vrlab/²", "vrlab/" + "9" * 5000])
def test_a_version_that_is_no_number_is_refused(profile):
    with pytest.raises(SessionFileError, match="this program reads"):
        migrated({}, profile)
