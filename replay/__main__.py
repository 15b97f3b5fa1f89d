"""``python -m replay`` is the command ``replay``."""

import os
import sys

# ``-m`` puts the current folder before the environment: a ``numpy.py`` there would be imported in place of numpy.
# Where the packages themselves are imported from the current folder, it stays.
_CURRENT, _PACKAGES = os.path.realpath(os.curdir), os.path.realpath(os.path.join(os.path.dirname(__file__), os.pardir))  # noqa: PTH118, PTH120
if not sys.flags.safe_path and sys.path and os.path.realpath(sys.path[0] or os.curdir) == _CURRENT != _PACKAGES:
    del sys.path[0]

from replay.cli.main import main  # noqa: E402

sys.exit(main())
