"""Reads the files of failing triangle pairs that ``replay stress --out`` writes."""

from types import SimpleNamespace

import numpy as np


def read_cases(path):
    with np.load(path, allow_pickle=False) as file:
        return SimpleNamespace(**{name: array[()] if array.ndim else array.item() for name, array in file.items()})
