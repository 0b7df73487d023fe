"""Matrix Market text and small linear algebra in plain Python, so that answers are checked by other code than the
daemon's. It reads what is known to be legal and does not judge."""


class Matrix:
    """rows, cols, symmetric (by the banner) and entries {(i, j): value}, both halves of a symmetric one."""

    def __init__(self, text):
        lines = [line.split("%")[0].split() if not line.startswith("%%M") else line.split() for line in
                 text.splitlines()]
        banner = [word.lower() for word in lines[0]]
        lines = [line for line in lines[1:] if line]
        self.symmetric = banner[4] == "symmetric"
        self.rows, self.cols = int(lines[0][0]), int(lines[0][1])
        self.entries = {}
        for i, j, value in self._coordinates(lines[1:]) if banner[2] == "coordinate" else self._array(lines[1:]):
            self.entries[i, j] = value
            if self.symmetric:
                self.entries[j, i] = value

    @staticmethod
    def _coordinates(lines):
        return ((int(line[0]) - 1, int(line[1]) - 1, float(line[2])) for line in lines)

    def _array(self, lines):
        places = ((i, j) for j in range(self.cols) for i in range(j if self.symmetric else 0, self.rows))
        return ((i, j, float(word)) for (i, j), word in zip(places, (word for line in lines for word in line)))

    def apply(self, x):
        y = [0.0] * self.rows
        for (i, j), value in self.entries.items():
            y[i] += value * x[j]
        return y

    def apply_transposed(self, x):
        y = [0.0] * self.cols
        for (i, j), value in self.entries.items():
            y[j] += value * x[i]
        return y

    def is_symmetric(self):
        return self.rows == self.cols and all(self.entries.get((j, i), 0.0) == value
                                              for (i, j), value in self.entries.items())

    def vector(self):
        """As a vector: one column or one row."""
        out = [0.0] * max(self.rows, self.cols)
        for (i, j), value in self.entries.items():
            out[i + j] = value
        return out


def dot(x, y):
    return sum(a * b for a, b in zip(x, y))


def cholesky_solve(matrix, b):
    """x with matrix x = b, or None where a pivot is not positive. Dense: for small matrices."""
    n = matrix.rows
    lower = [[matrix.entries.get((i, j), 0.0) for j in range(i + 1)] for i in range(n)]
    x = list(b)
    for i in range(n):
        for j in range(i + 1):
            lower[i][j] -= dot(lower[i][:j], lower[j][:j])
            if i == j:
                if not lower[i][i] > 0.0:
                    return None
                lower[i][i] **= 0.5
            else:
                lower[i][j] /= lower[j][j]
        x[i] = (x[i] - dot(lower[i][:i], x)) / lower[i][i]
    for i in reversed(range(n)):
        x[i] = (x[i] - sum(lower[k][i] * x[k] for k in range(i + 1, n))) / lower[i][i]
    return x
