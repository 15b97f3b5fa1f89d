"""``python -m replay`` is the command ``replay``."""

import sys

from replay.cli.main import main

sys.exit(main())
