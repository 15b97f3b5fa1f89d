import pytest

from replay.errors import UnknownLabelError
from replay.running.by_label import ByLabel


@pytest.mark.parametrize(("labels", "known"), [(("exact", "hull50"), "exact, hull50"), ((), "none")])
def test_unknown_label_is_refused_with_the_known_labels(labels, known):
    """Two detectors by label, or none; "hull" is not among them."""
    any_value = 1
    with pytest.raises(UnknownLabelError, match=f"no label 'hull' here; there are: {known}"):
        ByLabel(dict.fromkeys(labels, any_value))["hull"]
