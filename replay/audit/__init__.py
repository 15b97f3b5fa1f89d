"""The audit: what a detector missed and invented beside an oracle, frame by frame and episode by episode.

The package can be called: ``replay.audit(session, detectors=...)`` is ``replay.auditor.audit``.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _CallablePackage(ModuleType):
    """Lets the public function and the package that holds its parts share the name ``replay.audit``."""

    def __call__(self, *args: Any, **more: Any) -> Any:
        from replay.auditor import audit

        return audit(*args, **more)


sys.modules[__name__].__class__ = _CallablePackage
