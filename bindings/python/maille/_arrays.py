"""Arrays as the library takes them, made from what users give."""

from __future__ import annotations

from typing import Any, Optional

import numpy as np
import numpy.typing as npt

NDArray = npt.NDArray[Any]

MOST_POINTS = 0xFFFFFFFE
"""Of a mesh in memory (maille/mesh.h)."""

_types = {np.dtype(name) for name in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8")}


def _wanted_type(array: NDArray, where: str) -> None:
    if array.dtype in _types:
        return
    advice = {"b": "; use .astype('uint8')", "c": "; give real and imaginary parts as two columns"}.get(
        array.dtype.kind, "")
    if array.dtype.kind == "f":
        advice = "; use .astype('float32') or .astype('float64')"
    raise TypeError(f"{where}: numbers of int8 to int64, uint8 to uint64, float32 or float64 are wanted, "
                    f"not {array.dtype}{advice}")


def numbers(values: Any, where: str) -> NDArray:
    """An array of a type that meshes have, in native byte order and C order. One that is so is not copied."""
    array = np.asarray(values)
    array = array.astype(array.dtype.newbyteorder("="), copy=False)
    _wanted_type(array, where)
    return np.require(array, requirements=["C", "A"])


def positions(values: Any) -> NDArray:
    if not hasattr(values, "dtype"):
        values = np.asarray(values, dtype=float)
    array = numbers(values, "points")
    if array.size == 0 and array.ndim < 2:
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        advice = "; add a column of zeros" if array.ndim == 2 and array.shape[1] == 2 else ""
        raise ValueError(f"points: an array of shape (n, 3) is wanted, not {array.shape}{advice}")
    if len(array) > MOST_POINTS:
        raise ValueError(f"points: a mesh in memory has at most {MOST_POINTS} points")
    return array


def tuples(values: Any, where: str, count: Optional[int], of_what: str) -> NDArray:
    """(n,) or (n, components); n is `count` where there is one."""
    array = numbers(values, where)
    if array.ndim == 0 and count is None:
        array = array.reshape(1)
    if array.ndim not in (1, 2) or (array.ndim == 2 and array.shape[1] == 0):
        advice = ""
        if array.ndim > 2 and array.size:
            advice = f"; .reshape({len(array)}, {array.size // len(array)}) makes such a one"
        raise ValueError(f"{where}: an array of shape (n,) or (n, components) is wanted, not {array.shape}{advice}")
    if count is not None and len(array) != count:
        raise ValueError(f"{where}: {count} values are wanted, one for each {of_what}, not {len(array)}")
    return array


def integers(values: Any, where: str, most: int, dtype: str) -> NDArray:
    """Integers from 0 to `most`, as the type that the library wants. Of that width they are not copied."""
    array = np.asarray(values)
    if array.size == 0:
        return np.zeros(array.shape, dtype)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{where}: integers are wanted, not {array.dtype}")
    wanted = np.dtype(dtype)
    if array.dtype.kind == "i" and int(array.min()) < 0:
        raise ValueError(f"{where}: there is {int(array.min())}; numbers are counted from 0")
    if array.dtype.itemsize > wanted.itemsize or most < np.iinfo(wanted).max:
        if int(array.max()) > most:
            raise ValueError(f"{where}: there is {int(array.max())}, and {most} is the largest there can be")
    array = np.require(array.astype(array.dtype.newbyteorder("="), copy=False), requirements=["C", "A"])
    if array.dtype.itemsize == wanted.itemsize:
        return array.view(wanted)
    return array.astype(wanted)


def triple(values: Any, where: str) -> tuple[float, float, float]:
    numbers3 = [float(value) for value in np.asarray(values, dtype=float).ravel()]
    if len(numbers3) != 3:
        raise ValueError(f"{where}: three numbers are wanted, not {len(numbers3)}")
    return (numbers3[0], numbers3[1], numbers3[2])
