import ctypes
import json
import os
import platform
import subprocess
from unittest.mock import Mock

import pytest

from replay.document import machine as module
from replay.document.machine import give_back_memory, machine, processor_name, versions


def test_versions_list_python_and_packages_that_decide_verdicts():
    """Five packages must be among them."""
    result = versions()
    assert result["python"] == platform.python_version()
    assert {"numpy", "numba", "python-fcl", "rerun-sdk", "vrlab-replay"} <= set(result)


def test_the_machine_is_named_without_naming_user_or_host():
    """The number of cores and the architecture are as Python's standard library says."""
    text = json.dumps(machine())
    assert machine()["cores"] == os.cpu_count() and machine()["architecture"] == platform.machine()
    assert platform.node() == "" or platform.node() not in text


@pytest.mark.parametrize(
    ("listed", "named"),
    [
        ("processor\t: 0\nmodel name\t: AMD  EPYC 9\nmodel name\t: other\n", "AMD EPYC 9"),
        ("processor\t: 0\nBogoMIPS\t: 50\n", platform.machine()),
    ],
)
def test_linux_processor_is_named_by_model_or_architecture(listed, named, tmp_path, monkeypatch):
    """``listed``: of /proc/cpuinfo, of which the first model counts; without the file the architecture is the name."""
    monkeypatch.setattr(platform, "system", lambda: "Linux")
    monkeypatch.setattr(module, "LINUX_PROCESSOR_FILE", tmp_path / "cpuinfo")
    assert processor_name() == platform.machine()
    (tmp_path / "cpuinfo").write_text(listed)
    assert processor_name() == named


@pytest.mark.parametrize(("answer", "named"), [("Apple M2\n", "Apple M2"), (None, platform.machine())])
def test_mac_is_named_by_its_command_or_architecture(answer, named, monkeypatch):
    """``answer``: of the system's command; None: there is no such command."""

    def asked(*_, **__):
        if answer is None:
            raise FileNotFoundError
        return subprocess.CompletedProcess((), 0, answer)

    monkeypatch.setattr(platform, "system", lambda: "Darwin")
    monkeypatch.setattr(subprocess, "run", asked)
    assert processor_name() == named


@pytest.mark.parametrize(("library", "calls"), [("glibc", 1), ("", 0)])
def test_freed_memory_is_returned_to_the_system_under_glibc(library, calls, monkeypatch):
    """Only glibc keeps freed memory; ``malloc_trim`` returns it."""
    c_library = Mock()
    monkeypatch.setattr(platform, "libc_ver", lambda: (library, ""))
    monkeypatch.setattr(ctypes, "CDLL", lambda _: c_library)
    give_back_memory()
    assert c_library.malloc_trim.call_count == calls
