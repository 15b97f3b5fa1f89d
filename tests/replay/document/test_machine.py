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
    """Python's version is that of the standard library; among the packages are these five."""
    listed = versions()
    assert listed["python"] == platform.python_version()
    assert {"numpy", "numba", "python-fcl", "rerun-sdk", "vrlab-replay"} <= set(listed)


def test_the_machine_is_named_without_naming_user_or_host(monkeypatch):
    """Cores and architecture are as Python's standard library says; user and host are made up and in no value."""
    monkeypatch.setattr(platform, "node", lambda: "made-up-host")
    monkeypatch.setenv("USER", "made-up-user")
    named = machine()
    assert named["cores"] == os.cpu_count() and named["architecture"] == platform.machine()
    assert "made-up" not in json.dumps(named)


@pytest.mark.parametrize(
    ("processor_file", "name"),
    [
        pytest.param("processor\t: 0\nmodel name\t: AMD  EPYC 9\nmodel name\t: other\n", "AMD EPYC 9", id="two models"),
        pytest.param("processor\t: 0\nBogoMIPS\t: 50\n", platform.machine(), id="no model"),
        pytest.param(None, platform.machine(), id="no file"),
    ],
)
def test_linux_processor_is_named_by_model_or_architecture(processor_file, name, tmp_path, monkeypatch):
    """``processor_file``: text of /proc/cpuinfo, of which the first model counts; else the architecture is the name.

    Two blanks in a row become one.
    """
    monkeypatch.setattr(platform, "system", lambda: "Linux")
    monkeypatch.setattr(module, "LINUX_PROCESSOR_FILE", tmp_path / "cpuinfo")
    if processor_file is not None:
        (tmp_path / "cpuinfo").write_text(processor_file)
    assert processor_name() == name


@pytest.mark.parametrize(
    ("output", "name"),
    [("Apple M2\n", "Apple M2"), (None, platform.machine())],
    ids=["command answers", "no such command"],
)
def test_mac_is_named_by_its_command_or_architecture(output, name, monkeypatch):
    """``output``: of the command by which macOS names its processor; None: there is no such command."""

    def run_command(*_, **__):
        if output is None:
            raise FileNotFoundError
        return subprocess.CompletedProcess((), 0, output)

    monkeypatch.setattr(platform, "system", lambda: "Darwin")
    monkeypatch.setattr(subprocess, "run", run_command)
    assert processor_name() == name


@pytest.mark.parametrize(("c_library_name", "calls"), [("glibc", 1), ("", 0)], ids=["glibc", "another C library"])
def test_freed_memory_is_returned_to_the_system_under_glibc(c_library_name, calls, monkeypatch):
    """Only glibc keeps freed memory; its function ``malloc_trim`` returns it."""
    c_library = Mock()
    monkeypatch.setattr(platform, "libc_ver", lambda: (c_library_name, ""))
    monkeypatch.setattr(ctypes, "CDLL", lambda _: c_library)
    give_back_memory()
    assert c_library.malloc_trim.call_count == calls
