"""The options of ``replay diff``."""

import pytest

from replay.cli.main import main


@pytest.mark.parametrize("pair", ["=b", "a=", "ab", "="])
def test_compare_takes_a_label_of_each_run(pair, tmp_path, capsys):
    """`replay diff OLD NEW --compare` takes two labels of detectors with an equals sign between.

    In ``pair`` a label, both, or the sign is absent.
    """
    assert main(["diff", str(tmp_path), str(tmp_path), "--compare", pair]) == 2
    assert f"{pair!r} is not OLD=NEW" in capsys.readouterr().err
