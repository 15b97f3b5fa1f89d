"""Code of compiled templates, kept where Python keeps that of modules: to compile them takes 80 ms a run."""

import sys
from contextlib import suppress
from hashlib import sha256
from importlib.resources import files
from importlib.util import cache_from_source
from os import getpid
from pathlib import Path

import jinja2
from jinja2.bccache import Bucket, BytecodeCache

DIGEST_BYTES = sha256().digest_size


class TemplateCache(BytecodeCache):
    """A file a template, which begins with the digest of what follows; where none can be written, none is.

    Jinja compares the checksum of the template. The code must not depend on filters: the environment has to compile
    without ``optimized``, which computes filters of constants.
    """

    def get_source_checksum(self, source: str) -> str:
        """Checksum of a template, and of the version of Jinja that compiles it."""
        return super().get_source_checksum(f"{jinja2.__version__}\n{source}")

    def load_bytecode(self, bucket: Bucket) -> None:
        """Read the code of a template into the bucket, if an intact file has it."""
        with suppress(OSError):
            content = _file_of(bucket).read_bytes()
            digest, code = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
            if sha256(code).digest() == digest:
                bucket.bytecode_from_string(code)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Write the code of a template, unless Python was told to write none."""
        if sys.dont_write_bytecode:
            return
        code = bucket.bytecode_to_string()
        path = _file_of(bucket)
        unfinished = path.with_name(f"{path.name}.{getpid()}")
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            unfinished.write_bytes(sha256(code).digest() + code)
            unfinished.replace(path)


def _file_of(bucket: Bucket) -> Path:
    """Path of the code of a template; the bucket's key is a digest of the template's name."""
    return Path(cache_from_source(str(files("replay.show.report") / f"{bucket.key}.py")))
