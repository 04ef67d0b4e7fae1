"""MATLAB files: up to v7 with SciPy, v7.3 (which is HDF5) and other HDF5 with h5py."""

from __future__ import annotations

import io
import warnings
from collections import Counter
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError

_HDF5 = b"\x89HDF\r\n\x1a\n"


def is_hdf5(raw: bytes) -> bool:
    """Whether these are the bytes of an HDF5 file, with or without the block that MATLAB puts before it."""
    return raw.startswith((_HDF5, b"MATLAB 7.3")) or raw[512:520] == _HDF5


def read_matlab(raw: bytes, notes: list[str]) -> pd.DataFrame:
    """The vectors of a MATLAB file up to v7; fields of structures and columns of matrices become columns.

    Raises:
        InputError: not a MATLAB file, or nothing in it that is a vector.
    """
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            stream: Any = io.BytesIO(raw)  # the stubs of scipy know of paths only
            content = loadmat(stream, squeeze_me=True, struct_as_record=True)
    except Exception as error:  # the reader of a foreign format may raise anything on bad bytes
        raise InputError(
            "is not a MATLAB file that can be read", remedy="in MATLAB save it with -v7"
        ) from error
    vectors: dict[str, np.ndarray] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            _flatten(name, value, vectors)
    return _longest(vectors, notes)


def read_hdf5(raw: bytes, notes: list[str]) -> pd.DataFrame:
    """The vectors of a MATLAB v7.3 file, or of any HDF5 file.

    Raises:
        InputError: h5py is not installed, the file is damaged, or holds no vector.
    """
    try:
        import h5py
    except ImportError as error:
        raise InputError(
            "is HDF5 (MATLAB v7.3 saves that too), which needs h5py",
            remedy="pip install 'ffc-id[hdf5]', or in MATLAB save it with -v7",
        ) from error
    vectors: dict[str, np.ndarray] = {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or item.ndim > 2:
            return  # "#refs#" is where MATLAB keeps the content of cells
        if item.attrs.get("MATLAB_class") == b"char":
            return
        array = np.squeeze(item[()])  # MATLAB stores its matrices by columns; _flatten takes either
        _flatten(name.replace("/", "."), array, vectors)

    try:
        with h5py.File(io.BytesIO(raw), "r") as content:
            content.visititems(visit)
    except Exception as error:  # the reader of a foreign format may raise anything on bad bytes
        raise InputError(
            "is a damaged HDF5 file", remedy="copy it again from where it was recorded"
        ) from error
    return _longest(vectors, notes)


def _longest(vectors: dict[str, np.ndarray], notes: list[str]) -> pd.DataFrame:
    """The vectors of the commonest length as one table."""
    lengths = Counter(len(vector) for vector in vectors.values())
    if not lengths:
        raise InputError("holds no vectors of numbers", remedy="save time, position and torque as vectors")
    rows = lengths.most_common(1)[0][0]
    left = [name for name, vector in vectors.items() if len(vector) != rows]
    if left:
        notes.append(f"left out, not {rows} rows long: {', '.join(sorted(left)[:8])}")
    return pd.DataFrame({name: vector for name, vector in vectors.items() if len(vector) == rows})


def _flatten(name: str, value: Any, vectors: dict[str, np.ndarray]) -> None:
    """Vectors of numbers, the columns of matrices and the fields of structures, each under a name."""
    array = np.asarray(value)
    if array.dtype.names:
        for field in array.dtype.names:
            item = array[field]
            _flatten(f"{name}.{field}", item.item() if item.ndim == 0 else item, vectors)
    elif array.dtype.kind in "fiub" and array.ndim == 1 and len(array) > 1:
        vectors[name] = array.astype(array.dtype.newbyteorder("="))
    elif array.dtype.kind in "fiub" and array.ndim == 2 and min(array.shape) > 0:
        columns = array if array.shape[0] >= array.shape[1] else array.T
        for index in range(min(columns.shape[1], 64)):
            vectors[f"{name}_{index + 1}"] = columns[:, index].astype(array.dtype.newbyteorder("="))
