"""The base class of the records of which the document of a run is made, and the limits of their numbers."""

from typing import Annotated, TypeAlias

from msgspec import Meta, Struct

Count: TypeAlias = Annotated[int, Meta(ge=0)]
Seconds: TypeAlias = Annotated[float, Meta(ge=0.0)]
Metres: TypeAlias = Annotated[float, Meta(ge=0.0)]
Fraction: TypeAlias = Annotated[float, Meta(ge=0.0, le=1.0)]
Digest: TypeAlias = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]

Counts: TypeAlias = dict[str, Count]
"""Name -> how many."""


class Record(Struct, frozen=True, omit_defaults=True):
    """A frozen record with named fields; a field that has its default is left out of the JSON.

    Types and limits are checked where a record is read, not where it is made.
    """
