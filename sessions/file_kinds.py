"""Names what a file is by its first bytes, for the sentence of a reader that cannot read it.

A share link gives a page to sign in, a store an error message, a repository a pointer: each of them under the name of
the file that was meant. No reader takes these (`substitute`). Other kinds are data that some reader takes, and each
reader names them only where its own reading fails (`file_kind`).
"""

import codecs
import re
from typing import Final, NamedTuple


class FileKind(NamedTuple):
    """The noun of a kind of file, with its article, and what to do with such a file."""

    noun: str
    cure: str

    def __str__(self) -> str:
        """The noun and the cure, as they end a sentence."""
        return f"{self.noun}; {self.cure}"


HEAD_BYTES: Final = 1024
"""So many bytes tell every kind."""

AGAIN: Final = "download the file again"
HTML: Final = FileKind("an HTML page, as a share link or a page to sign in gives it", "download the file itself")
ERROR_IN_JSON: Final = FileKind("an error message of a server in JSON", AGAIN)
ERROR_IN_XML: Final = FileKind("an error message of a server in XML", AGAIN)
JSON: Final = FileKind("JSON text", "export it in the format that its name says")
XML: Final = FileKind("XML text", "export it in the format that its name says")
UTF_16: Final = FileKind("text in UTF-16", "save it as UTF-8")
ENCODINGS: Final = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}
"""First bytes of a text in another encoding than UTF-8 that says so; those of UTF-32 begin with those of UTF-16."""

SUBSTITUTES: Final = {
    b"version https://git-lfs.github.com/spec/": FileKind(
        "a pointer of Git LFS, not the file itself", "fetch it: git lfs pull"
    ),
    b"%PDF-": FileKind("a PDF", "name the file of the data"),
    b"\x89PNG\r\n": FileKind("a picture (PNG)", "name the file of the data"),
    b"\xff\xd8\xff": FileKind("a picture (JPEG)", "name the file of the data"),
}
"""First bytes of files that no reader takes."""

DATA_FILES: Final = {
    b"PK\x03\x04": FileKind("a workbook of a spreadsheet, or another archive", "unpack it, or save its table as CSV"),
    b"\xd0\xcf\x11\xe0": FileKind("a workbook of an old Excel", "save its table as CSV"),
    b"\x1f\x8b": FileKind("compressed by gzip", "unpack it first"),
    b"\x28\xb5\x2f\xfd": FileKind("compressed by Zstandard", "unpack it first"),
    b"7z\xbc\xaf": FileKind("compressed by 7-Zip", "unpack it first"),
    b"Rar!": FileKind("compressed by RAR", "unpack it first"),
    b"PAR1": FileKind("a Parquet file", "write its table as CSV"),
    b"ARROW1": FileKind("an Arrow file", "write its table as CSV"),
    b"\x89HDF": FileKind("an HDF5 file", "write its tables as CSV"),
    b"MATLAB 5.0": FileKind("a file of MATLAB", "write its table as CSV"),
    b"\x93NUMPY": FileKind("an array of NumPy", "write it as CSV"),
    b"Kaydara FBX": FileKind("an FBX", "export it as GLB"),
    b"\x89MCAP0": FileKind("an MCAP", "name it where a recording is expected"),
    b"glTF": FileKind("a GLB", "name it where a mesh is expected"),
    **{mark: FileKind(f"text in {encoding}", "save it as UTF-8") for mark, encoding in ENCODINGS.items()},
}
"""First bytes of files that a reader may take."""

_PAGE = re.compile(rb"<(?:!doctype\s+html|html[\s>]|head[\s>])", re.IGNORECASE)
_ERROR_MEMBER = re.compile(rb'\{\s*"(?:error|errors|message|detail|status|code)"\s*:')
_ERROR_ELEMENT = re.compile(rb"(?:<\?xml[^>]*>\s*)?<Error[\s>]")
_ELEMENT = re.compile(rb"<[?!]|<[a-zA-Z][^<>]*>\s*[<\r\n]")
_OBJECT = re.compile(rb'\{\s*["}]|\[\s*\{')
_LINE_OF_CELLS = re.compile(rb"[^\n]*\}\s*\n\s*[^\s{}\[\]\"]")
"""A line of JSON above the header of a table, as some loggers write it."""
BLANKS: Final = FileKind("a file of blanks or zeros alone", "copy or record it again")


def substitute(head: bytes) -> FileKind | None:
    """Returns what stands in place of the file that was meant, by its first bytes; ``None``: nothing known."""
    text = _stripped(head)
    if text.startswith(b"<") and _PAGE.search(text):
        return HTML
    if _ERROR_MEMBER.match(text):
        return ERROR_IN_JSON
    if _ERROR_ELEMENT.match(text):
        return ERROR_IN_XML
    return _by_start(SUBSTITUTES, head)


def file_kind(head: bytes) -> FileKind | None:
    """Returns the kind of a file by its first bytes; ``None``: none that is known here."""
    text = _stripped(head)
    kind = substitute(head) or _by_start(DATA_FILES, head)
    if kind is not None:
        return kind
    if head and not text.strip(b"\0"):
        return BLANKS
    if _OBJECT.match(text) and not _LINE_OF_CELLS.match(text):
        return JSON
    return XML if _ELEMENT.match(text) else None


def named_encoding(data: bytes) -> str:
    """Returns the encoding other than UTF-8 that the first bytes of a text name, or ``""``."""
    return next((name for mark, name in ENCODINGS.items() if data.startswith(mark)), "")


def _stripped(head: bytes) -> bytes:
    return head[:HEAD_BYTES].removeprefix(codecs.BOM_UTF8).lstrip()


def _by_start(table: dict[bytes, FileKind], head: bytes) -> FileKind | None:
    return next((kind for start, kind in table.items() if head.startswith(start)), None)
