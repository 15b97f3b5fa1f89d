"""Recognises the format of a recording by its first bytes and its names, with the reason, for ``import auto``."""

from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError
from sessions.file_kinds import JSON, file_kind
from sessions.importers.aframe import JSON_CURE
from sessions.importers.csv_head import read_head
from sessions.importers.csv_table import NUMBER, excel_separator
from sessions.importers.hands.hand_columns import hand_layout
from sessions.importers.optitrack import FIRST
from sessions.importers.uxf import TRACKER, TRIALS

STARTS: Final = (
    (b"\x89MCAP0\r\n", "mcap", "it is an MCAP file"),
    (b"XDF:", "xdf", "it begins with XDF:"),
    (b"\x1f\x8b", "xdf", "it is compressed by gzip, as .xdfz files are"),
    (FIRST.encode(), "optitrack", f"line 1 begins with {FIRST}, as Motive's exports do"),
    (b"{", "aframe", "it is JSON"),
    (b"<mujoco", "mjcf", "it begins with <mujoco, as models of MuJoCo do"),
    (b"#usda", "usd", "it begins with #usda, as scenes of USD do"),
    (b"PXR-USDC", "usd", "it begins with PXR-USDC, as scenes of USD do"),
    (b"#ROSBAG", "", "it is a bag of ROS 1"),
    (b"SQLite format 3", "", "it is an SQLite file, as bags of ROS 2 are"),
)
"""First bytes, the format that they tell, and why; bags that are no MCAP files are of none."""
ANOTHER_BAG: Final = (
    "make it an MCAP file first: pip install rosbags; rosbags-convert --src BAG --dst FOLDER --dst-storage mcap"
)
SEPARATORS: Final = (",", ";", "\t", "|")
COMMENTS: Final = ("#", "%", "//")
"""What a line above a table may begin with."""
LEAST_NUMBERS: Final = 7
"""Numbers between spaces that make a line a row of poses: a place and a quaternion."""
FIRST_BYTES: Final = 1 << 16


def recognised_format(source: Path) -> tuple[str, str]:
    """A format of ``IMPORTERS`` and why; ImportFileError where nothing speaks for one."""
    if source.is_dir():
        return _recognised_folder(source)
    if source.name == TRIALS:
        return "uxf", f"its name is {TRIALS}"
    if TRACKER.fullmatch(source.name):
        raise ImportFileError(f"{source} is one file of a UXF session; name the session's folder")
    with source.open("rb") as file:
        head = file.read(FIRST_BYTES).removeprefix(b"\xef\xbb\xbf")
    for start, name, why in STARTS:
        if head.lstrip().startswith(start):
            if not name:
                raise ImportFileError(f"{source}: {why}; {ANOTHER_BAG}")
            return name, why
    if head.startswith(b"PK\x03\x04") and source.suffix.lower() == ".usdz":
        return "usd", "it is a package of USD"
    _refuse_other_kind(source, head)
    if b"\x00" not in head and (joints := joints_in(source)):
        return "hands", joints
    number, line = _first_row_of_cells(head.decode("utf-8", errors="replace"))
    separators = [letter for letter in SEPARATORS if letter in line]
    if separators and line.strip().replace("\t", "").isprintable() and "\ufffd" not in line:
        return "csv", f"line {number} has {line.count(separators[0]) + 1} cells between {separators[0]!r}"
    if len(cells := line.split()) >= LEAST_NUMBERS and all(map(NUMBER.fullmatch, cells)):
        return "csv", f"line {number} has {len(cells)} numbers between spaces"
    raise ImportFileError(f"{source}: nothing says what it is; name the format before the source: replay import FORMAT")


def _refuse_other_kind(source: Path, head: bytes) -> None:
    """Refuse a file of a known kind that no importer reads."""
    kind = file_kind(head)
    if kind is JSON:
        raise ImportFileError(f"{source}: it is JSON, but no A-Frame motion capture; {JSON_CURE}")
    if kind is not None:
        raise ImportFileError(f"{source}: it is {kind}")


def _first_row_of_cells(text: str) -> tuple[int, str]:
    """The number and the text of the first line that is not empty, no comment and not Excel's ``sep=;``."""
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() and not line.lstrip().startswith(COMMENTS) and not excel_separator(line):
            return number, line
    return 1, ""


def joints_in(source: Path) -> str:
    """Why a CSV is one of tracked hands, or ``""``."""
    layout = hand_layout(read_head(source))
    if layout is None:
        return ""
    where = f"column {layout.joint!r} names" if layout.joint else "its columns are called like"
    return f"{where} joints of a hand"


def _recognised_folder(source: Path) -> tuple[str, str]:
    if any(path.name == TRIALS or TRACKER.fullmatch(path.name) for path in source.rglob("*.csv")):
        return "uxf", f"the folder holds {TRIALS} or files OBJECT_movement_T001.csv"
    if (source / "metadata.yaml").is_file():
        raise ImportFileError(f"{source} is a bag of ROS 2: name the .mcap file in it; of .db3 files {ANOTHER_BAG}")
    raise ImportFileError(f"{source} is a folder, but not one of UXF; name a file, or the format before the source")
