"""Numbers in: numpy arrays in a request, matrices as Matrix Market text. And out: a result's file of arrays."""
from __future__ import annotations

import io
import json
from typing import Any, Optional

import numpy as np


def plain(value: Any) -> Any:
    """What json can't write, as lists and numbers: arrays and numbers of numpy."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"a request holds no {type(value).__name__}: give numbers, lists, arrays, texts and dictionaries")


def to_json(request: Any) -> bytes:
    """A request as JSON. NaN and infinite numbers are refused: JSON has none."""
    return json.dumps(request, default=plain, allow_nan=False).encode()


def from_npz(data: bytes) -> dict:
    """A result.npz: its arrays, those of Gauss points together, beside what it says in JSON."""
    with np.load(io.BytesIO(data)) as held:
        found = json.loads(held["result.json"])
        for name in held.files:
            if name.startswith("stress_gauss_"):
                found.setdefault("stress_gauss", {})[name[len("stress_gauss_"):]] = held[name]
            elif name != "result.json":
                found[name] = held[name]
    return found


def entries_of(matrix: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[int, int]]:
    """Rows, columns and values of what is not zero, and the shape: of a scipy matrix, or of anything that is an array."""
    if hasattr(matrix, "tocoo"):
        coo = matrix.tocoo()
        return np.asarray(coo.row), np.asarray(coo.col), np.asarray(coo.data, dtype=float), coo.shape
    dense = np.asarray(matrix, dtype=float)
    if dense.ndim != 2:
        raise ValueError(f"a matrix has two dimensions, not {dense.ndim}")
    rows, columns = np.nonzero(dense)
    return rows, columns, dense[rows, columns], dense.shape


def matrix_market(matrix: Any, symmetric: bool = False) -> str:
    """Matrix Market text of a matrix, to the last digit. symmetric: its lower triangle stands for the whole; the upper
    one must be equal to it. Values of one place that a scipy matrix has several times are added by the service."""
    rows, columns, values, shape = entries_of(matrix)
    if symmetric:
        if hasattr(matrix, "tocoo"):
            apart = abs(matrix - matrix.T)
            differs = apart.nnz > 0 and apart.max() > 0
        else:
            differs = not np.array_equal(np.asarray(matrix), np.asarray(matrix).T)
        if differs:
            raise ValueError("the matrix is not symmetric: its two triangles differ")
        lower = rows >= columns
        rows, columns, values = rows[lower], columns[lower], values[lower]
    kind = "symmetric" if symmetric else "general"
    lines = [f"%%MatrixMarket matrix coordinate real {kind}", f"{shape[0]} {shape[1]} {len(values)}"]
    lines += [f"{i + 1} {j + 1} {value!r}" for i, j, value in zip(rows.tolist(), columns.tolist(), values.tolist())]
    return "\n".join(lines) + "\n"


def matrices(K: Any, p: Any, N: Optional[Any] = None, h: Optional[Any] = None) -> dict:
    """The problem min 1/2 u'Ku - p'u, h - N u >= 0: K (d x d) symmetric, p (d), N (m x d), h (m)."""
    problem = {"kind": "matrices", "K": matrix_market(K, symmetric=True), "p": np.asarray(p, dtype=float)}
    if (N is None) != (h is None):
        raise ValueError("N and h belong together")
    if N is not None:
        problem["N"], problem["h"] = matrix_market(N), np.asarray(h, dtype=float)
    return problem
