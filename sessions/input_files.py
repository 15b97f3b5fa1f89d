"""The one way to read a file that somebody names: a regular file, UTF-8 text, a TOML table key by key.

A device such as ``/dev/zero`` never ends, and a FIFO waits for a writer who may never come. So the kind of the file is
looked at before anything is read of it. What is wrong is one sentence: the file, or the table, the key and the nearest
known name.
"""

import codecs
import math
import re
import stat
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import Any, BinaryIO, Final

from sessions.errors import ImportFileError, SceneError, SessionError
from sessions.file_kinds import HEAD_BYTES, UTF_16, FileKind, file_kind, substitute

_KINDS = {"d": "a folder", "p": "a FIFO (named pipe)", "s": "a socket", "c": "a device", "b": "a device"}
"""First letter of a file's mode, as `ls -l` prints it -> what stands there."""

MOST_FAULTS, MOST_NAMED = 100, 500
"""So many faults are listed, and a nearest name is looked for among so many: both take time for each of them."""
# A key of 32 names: the parser's time grows with the square of a key's length.
_DEEP_KEY = re.compile(r"""(?<![\w.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){32}""")
QUOTED_CHARACTERS = 80  # A wrong value is quoted up to here, so that a message stays one line
FIRST_BYTES: Final = 200
"""Bytes of a file in which a text of two bytes a letter has zeros."""


def _as_path(path: str | Path) -> Path:
    return Path(path) if isinstance(path, str) else path


def special_kind(path: str | Path) -> str:
    """The kind of what a path leads to where it is no regular file, such as "a device"; else empty."""
    try:
        mode = _as_path(path).stat().st_mode
    except (OSError, ValueError):
        return ""
    letter = stat.filemode(mode)[0]
    return "" if letter == "-" else _KINDS.get(letter, "no regular file")


def check_regular(path: str | Path, what: str, error: type[Exception]) -> None:
    """Refuse a folder, a device, a FIFO or a socket by name; ``what`` is what the file should be, such as "scene"."""
    kind = special_kind(path)
    if kind:
        raise error(f"{what} {path} is {kind}; name a regular file")


@contextmanager
def open_input(path: str | Path, what: str, error: type[Exception]) -> Iterator[BinaryIO]:
    """A file open for reading; ``error``, one sentence, for whatever the system says while it is read.

    A page, an error message or a pointer in place of the file that was meant is refused by name.
    """
    check_regular(path, what, error)
    try:
        with _as_path(path).open("rb") as stream:
            kind = substitute(stream.read(HEAD_BYTES))
            if kind is not None:
                raise error(f"{what} {path} is {kind}")
            stream.seek(0)
            yield stream
    except FileNotFoundError:
        raise error(f"{what} {path} does not exist; check the path") from None
    except OSError as reason:
        raise error(
            f"{what} {path} cannot be read ({reason.strerror or reason}); check what it is and who may read it"
        ) from None


def read_bytes(path: str | Path, what: str, error: type[Exception]) -> bytes:
    """All bytes of a file."""
    with open_input(path, what, error) as stream:
        return stream.read()


def kind_of_file(path: str | Path) -> FileKind | None:
    """Returns the kind of a file, for the sentence of a reader that failed; ``None``: none that is known here."""
    with _as_path(path).open("rb") as stream:
        return file_kind(stream.read(HEAD_BYTES))


def read_text(path: str | Path, what: str, error: type[Exception], *, may_be_empty: bool = False) -> str:
    """The text of a UTF-8 file without a byte order mark; ``error`` where it is empty, unless it ``may_be_empty``."""
    data = read_bytes(path, what, error)
    if not (may_be_empty or data.strip()):
        raise error(f"{what} {path} is empty; copy or save it again")
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        kind = file_kind(data)
        raise error(f"{what} {path} is {kind or 'not UTF-8 text; save it as UTF-8'}") from None


def read_utf8_lines(source: Path) -> bytes:
    """Returns the bytes of a text in UTF-8 without its byte order mark, with line feeds; refuses other encodings."""
    text = read_bytes(source, "recording", ImportFileError)
    check_encoding(source, text)
    text = text.removeprefix(codecs.BOM_UTF8)
    text.decode("utf-8")
    return text if b"\n" in text else text.replace(b"\r", b"\n")


def check_encoding(source: Path, data: bytes) -> None:
    """Refuse what is no text, and text in another encoding than UTF-8, by its first bytes or zeros between letters."""
    first = data[:FIRST_BYTES]
    kind = file_kind(data) or (UTF_16 if 4 * first.count(0) > len(first) else None)
    if kind is not None:
        raise ImportFileError(f"{source}: this is no CSV in UTF-8 but {kind}")


def parse_toml(text: str, file: str, error: type[SessionError], faults: list[str] | None = None) -> "TomlTable":
    """The whole file as a table; the parser's own sentence names line and column. ``faults`` as in `TomlTable`."""
    try:
        if _DEEP_KEY.search(text):
            raise RecursionError
        return TomlTable(tomllib.loads(text), file, "", error, faults)
    except tomllib.TOMLDecodeError as reason:
        kind = file_kind(text.encode())
        raise error(f"{file}: this is not TOML{f' but {kind}' if kind else f': {reason}'}") from None
    except RecursionError:
        raise error(f"{file}: tables are nested too deeply; a scene needs three levels at most") from None
    except ValueError:  # the parser lets through what int() says of more than 4,300 digits
        raise error(f"{file}: a number has thousands of digits; write it shorter") from None


def nearest(word: str, known: Iterable[str]) -> str:
    """``; did you mean 'x'?`` or the list of what there is."""
    names = sorted(known)
    if len(names) > MOST_NAMED:
        return f"; there are {len(names):,} others"
    close = get_close_matches(word, names, n=1, cutoff=0.6)
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; there are: {', '.join(names)}" if names else "; there are none"


class TomlTable:
    """A table and where it stands; reading takes keys away, so that what is left over is unknown.

    A wrong key raises ``error``. Where ``faults`` is a list, its sentence is kept there instead, the default stands in
    for its value, and reading goes on: whoever asks for a list raises when there is one in it at the end.
    """

    def __init__(
        self,
        data: Mapping[str, Any],
        file: str,
        label: str,
        error: type[SessionError],
        faults: list[str] | None = None,
    ) -> None:
        self._data = dict(data)
        self._known: list[str] = []
        self.file, self.location, self.error, self.faults = file, label, error, faults

    def fail(self, message: str) -> SessionError:
        """The error to raise: file, table, message."""
        return self.error(f"{self.file}: {self.location + ': ' if self.location else ''}{message}")

    def refuse(self, message: str) -> None:
        """Raise this fault, or keep it where faults are collected."""
        if self.faults is None:
            raise self.fail(message)
        self.faults.append(str(self.fail(message)))
        if len(self.faults) == MOST_FAULTS:
            raise SceneError(*self.faults)

    def within(self, data: Mapping[str, Any], label: str) -> "TomlTable":
        """Another table of this file, its faults kept beside those of this one."""
        return TomlTable(data, self.file, label, self.error, self.faults)

    def __contains__(self, key: str) -> bool:
        self._known.append(key)
        return key in self._data

    def _take(self, key: str, default: Any) -> Any:
        self._known.append(key)
        return self._data.pop(key, default)

    def done(self, known: Iterable[str] = ()) -> bool:
        """Refuse every key that nobody asked for and that is not in ``known``; whether there was none."""
        self._known += known
        unknown = [key for key in self._data if key not in self._known]
        self._data = {}
        for key in unknown:
            self.refuse(f"unknown key {key!r}{nearest(key, self._known)}")
        return not unknown

    def text(self, key: str, default: str | None = "", among: Iterable[str] | None = None) -> str:
        """Text; required where ``default`` is None."""
        value = self._take(key, default)
        if value is None:
            near = [f"; did you mean it by {match!r}?" for match in get_close_matches(key, self._data, n=1)]
            self.refuse(f"{key} is missing; every such table needs it{''.join(near)}")
        elif not isinstance(value, str) or (default is None and not value):
            self.refuse(f"{key} is {_quoted(value)}; give text")
        elif among is not None and value != default and value not in among:
            self.refuse(f"{key} is {_quoted(value)}{nearest(value, among)}")
        else:
            return value
        return default or ""

    def _checked(self, key: str, default: Any, expected: str, fits: Callable[[Any], bool]) -> Any:
        value = self._take(key, default)
        if fits(value):
            return value
        self.refuse(f"{key} is {_quoted(value)}; {expected}")
        return default

    def count(self, key: str, default: int, least: int, most: int) -> int:
        """A whole number between bounds, both allowed."""
        expected = f"give a whole number from {least} to {most}"
        return int(self._checked(key, default, expected, lambda value: type(value) is int and least <= value <= most))

    def number(self, key: str, default: float, *, above: float = -math.inf) -> float:
        """A finite number above a bound."""
        expected = "give a finite number" if above == -math.inf else f"give a finite number above {above:g}"
        return float(self._checked(key, default, expected, lambda value: is_number(value) and value > above))

    def flag(self, key: str, default: bool = False) -> bool:
        """true or false."""
        return bool(self._checked(key, default, "give true or false", lambda value: isinstance(value, bool)))

    def texts(self, key: str, count: int | None = None) -> tuple[str, ...]:
        """A list of texts, of a given length where one is named."""
        value = self._checked(key, [], "give a list of texts", lambda value: _is_list(value, str) and all(value))
        if count is not None and len(value) != count:
            self.refuse(f"{key} has {len(value)} entries; give {count}")
        return tuple(value)

    def text_or_texts(self, key: str) -> tuple[str, ...]:
        """A text or a list of texts, as a list."""
        fits = lambda value: isinstance(value, str) or (_is_list(value, str) and all(value))  # noqa: E731
        value = self._checked(key, [], "give text, or a list of texts", fits)
        return (value,) if isinstance(value, str) and value else tuple(value)

    def vector(self, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Reads a vector of finite numbers of the default's length."""
        size = len(default)
        fits = lambda value: isinstance(value, list) and len(value) == size and all(map(is_number, value))  # noqa: E731
        return tuple(map(float, self._checked(key, list(default), f"give {size} finite numbers", fits)))

    def table(self, key: str) -> "TomlTable | None":
        """A table within, or ``None``."""
        value = self._checked(key, None, "give a table", lambda value: value is None or isinstance(value, dict))
        label = f"{self.location} {key}" if self.location else f"[{key}]"
        return None if value is None else self.within(value, label)

    def tables(self, key: str) -> "list[TomlTable] | None":
        """``[[key]]`` tables in order, or ``None`` where the key does not occur."""
        expected = f"write it as [[{key}]]"
        value = self._checked(key, None, expected, lambda value: value is None or _is_list(value, dict))
        if value is None:
            return None
        return [self.within(table, f"[[{key}]] {row}") for row, table in enumerate(value, start=1)]

    def named_tables(self, key: str) -> "dict[str, TomlTable]":
        """``[key.NAME]`` tables by name."""
        expected = f"write it as [{key}.NAME]"
        value = self._checked(
            key, {}, expected, lambda value: isinstance(value, dict) and _is_list([*value.values()], dict)
        )
        return {name: self.within(table, f"[{key}.{name}]") for name, table in value.items()}

    def rest(self) -> dict[str, Any]:
        """All keys not yet read, as written. Numbers must be finite. After this call no key counts as unknown."""
        for key, value in self._data.items():
            if not _all_finite(value):
                self.refuse(f"{key} is {_quoted(value)}; give finite numbers")
        left, self._data = self._data, {}
        return left


def _is_list(value: object, kind: type) -> bool:
    return isinstance(value, list) and all(isinstance(item, kind) for item in value)


def is_number(value: object) -> bool:
    """An int or float that float64 holds and that is finite; true and false are none."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an int above 1.8e308
        return False


def _quoted(value: object) -> str:
    """The value for a message, in at most ``QUOTED_CHARACTERS`` letters."""
    try:
        text = repr(value)
    except ValueError:  # an int of more than 4,300 digits, written in hexadecimal
        return "a number of thousands of digits"
    return text if len(text) <= QUOTED_CHARACTERS else text[: QUOTED_CHARACTERS - 3] + "..."


def _all_finite(value: object) -> bool:
    if isinstance(value, dict):
        return all(_all_finite(item) for item in value.values())
    if isinstance(value, list):
        return all(_all_finite(item) for item in value)
    return is_number(value) or not isinstance(value, int | float) or isinstance(value, bool)
