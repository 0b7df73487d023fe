"""Line charts as SVG text: panels with linear, logarithmic or count axes. Equal data give equal bytes."""
import math

INK, FAINT, GRID = "#222222", "#666666", "#dddddd"
FONT = "font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\""
# Okabe and Ito's colours, which people of every colour vision can tell apart (jfly.uni-koeln.de/color, 2008).
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7")
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def escape(text):
    return str(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def power_of_ten(exponent):
    return {0: "1", 1: "10"}.get(exponent, "10" + str(exponent).translate(SUPERSCRIPT))


class Log:
    """Decades from low to high, both rounded outward."""

    def __init__(self, low, high, most_labels=9):
        self.low, self.high = math.floor(math.log10(low) + 1e-9), math.ceil(math.log10(high) - 1e-9)
        self.high += self.high == self.low
        self.step = max(1, math.ceil((self.high - self.low) / most_labels))

    def at(self, value):
        if value <= 0:
            return 0.0
        return min(1.0, max(0.0, (math.log10(value) - self.low) / (self.high - self.low)))

    def ticks(self):
        return [(10.0 ** k, power_of_ten(k) if (k - self.low) % self.step == 0 else "")
                for k in range(self.low, self.high + 1)]

    def minor(self):
        if self.high - self.low > 5:
            return []
        return [m * 10.0 ** k for k in range(self.low, self.high) for m in range(2, 10)]


class Linear:
    def __init__(self, low, high, ticks=5):
        raw = (high - low) / ticks
        size = 10.0 ** math.floor(math.log10(raw))
        self.step = next(m * size for m in (1, 2, 2.5, 5, 10) if m * size >= raw * (1 - 1e-9))
        self.low, self.high = math.floor(low / self.step + 1e-9) * self.step, math.ceil(high / self.step - 1e-9) * self.step

    def at(self, value):
        return min(1.0, max(0.0, (value - self.low) / (self.high - self.low)))

    def ticks(self):
        count = round((self.high - self.low) / self.step)
        values = [self.low + k * self.step for k in range(count + 1)]
        return [(v, f"{v:.6g}".replace("-", "−")) for v in values]

    def minor(self):
        return []


class Count:
    """0, 1, 2, 5, 10, ...: numbers that may be zero, by the logarithm of one more."""

    def __init__(self, most):
        self.most = max(2, most)

    def at(self, value):
        return min(1.0, max(0.0, math.log1p(value) / math.log1p(self.most)))

    def ticks(self):
        values, size = [0], 1
        while size <= self.most:
            values += [m * size for m in ((1, 2, 5) if self.most < 200 else (1,)) if m * size <= self.most]
            size *= 10
        return [(v, f"{v:,}".replace(",", " ")) for v in values]

    def minor(self):
        return []


def marker(shape, x, y, colour, size=3.4, hollow=False):
    paint = f'fill="{"none" if hollow else colour}" stroke="{colour}" stroke-width="1.2"'
    if shape == "circle":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:.1f}" {paint}/>'
    if shape == "square":
        return f'<rect x="{x - size:.1f}" y="{y - size:.1f}" width="{2 * size:.1f}" height="{2 * size:.1f}" {paint}/>'
    if shape in ("cross", "plus"):
        a, b = (size, size) if shape == "cross" else (1.3 * size, 0)
        return (f'<path d="M{x - a:.1f} {y - b:.1f}L{x + a:.1f} {y + b:.1f}M{x - b:.1f} {y + a:.1f}L{x + b:.1f} {y - a:.1f}" '
                f'fill="none" stroke="{colour}" stroke-width="1.6"/>')
    corners = {"triangle": [(0, -1.25), (1.15, 0.85), (-1.15, 0.85)], "diamond": [(0, -1.35), (1.35, 0), (0, 1.35), (-1.35, 0)],
               "down": [(0, 1.25), (1.15, -0.85), (-1.15, -0.85)]}[shape]
    path = " ".join(f"{x + size * a:.1f},{y + size * b:.1f}" for a, b in corners)
    return f'<polygon points="{path}" {paint}/>'


class Panel:
    """A chart whose frame has its upper left corner at (left, top)."""

    def __init__(self, left, top, width, height, x, y):
        self.left, self.top, self.width, self.height, self.x, self.y = left, top, width, height, x, y
        self.out = []

    def px(self, value):
        return self.left + self.width * self.x.at(value)

    def py(self, value):
        return self.top + self.height * (1 - self.y.at(value))

    def text(self, x, y, text, anchor="start", size=11, colour=INK, turn=False, bold=False):
        turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if turn else ""
        weight = ' font-weight="bold"' if bold else ""
        self.out.append(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{colour}" text-anchor="{anchor}"{weight}{turned}>'
                        f'{escape(text)}</text>')

    def rule(self, x1, y1, x2, y2, colour=GRID, width=1.0, dash=""):
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.out.append(f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" '
                        f'stroke-width="{width}"{dashed}/>')

    def axes(self, title, x_label, y_label, room=40):
        """room: between the frame and the name of the y axis, for the numbers."""
        right, bottom = self.left + self.width, self.top + self.height
        for value in self.x.minor():
            self.rule(self.px(value), bottom - 3, self.px(value), bottom, FAINT)
        for value in self.y.minor():
            self.rule(self.left, self.py(value), self.left + 3, self.py(value), FAINT)
        for value, label in self.x.ticks():
            self.rule(self.px(value), self.top, self.px(value), bottom)
            self.text(self.px(value), bottom + 14, label, "middle", 10, FAINT)
        for value, label in self.y.ticks():
            self.rule(self.left, self.py(value), right, self.py(value))
            self.text(self.left - 5, self.py(value) + 3.5, label, "end", 10, FAINT)
        self.out.append(f'<rect x="{self.left:.1f}" y="{self.top:.1f}" width="{self.width:.1f}" height="{self.height:.1f}" '
                        f'fill="none" stroke="{FAINT}"/>')
        if title:
            self.text(self.left, self.top - 7, title, bold=True)
        self.text(self.left + self.width / 2, bottom + 30, x_label, "middle")
        self.text(self.left - room, self.top + self.height / 2, y_label, "middle", turn=True)

    def shade_below(self, value, label):
        """The part under a level; its name stands above the frame, where it hides no point."""
        y, bottom = self.py(value), self.top + self.height
        self.out.append(f'<rect x="{self.left:.1f}" y="{y:.1f}" width="{self.width:.1f}" height="{bottom - y:.1f}" '
                        f'fill="#f0f0ea"/>')
        self.edge = (y, label)

    def draw_edge(self):
        y, label = self.edge
        self.rule(self.left, y, self.left + self.width, y, INK, 1.2, "7,4")
        self.text(self.left + self.width, self.top - 6, label, "end", 10)

    def line(self, points, colour, dash="", width=1.6):
        path = "L".join(f"{self.px(x):.1f} {self.py(y):.1f}" for x, y in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        if len(points) > 1:
            self.out.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="{width}" '
                            f'stroke-linejoin="round"{dashed}/>')

    def mark(self, shape, x, y, colour, hollow=False, size=3.4):
        self.out.append(marker(shape, self.px(x), self.py(y), colour, size, hollow))


def legend(entries, left, top, column=190, per_row=4):
    """entries: (label, colour, dash, marker or None, hollow). Returns SVG lines and the height that they take."""
    out = []
    for k, (label, colour, dash, shape, hollow) in enumerate(entries):
        x, y = left + column * (k % per_row), top + 18 * (k // per_row)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        if colour:
            if dash is not None:
                out.append(f'<line x1="{x}" y1="{y}" x2="{x + 26}" y2="{y}" stroke="{colour}" stroke-width="1.8"{dashed}/>')
            if shape:
                out.append(marker(shape, x + 13, y, colour, hollow=hollow))
        out.append(f'<text x="{x + 32}" y="{y + 4}" font-size="11" fill="{INK}">{escape(label)}</text>')
    return out, 18 * ((len(entries) + per_row - 1) // per_row)


def document(width, height, title, parts):
    body = "\n".join(parts)
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" {FONT}>\n'
            f'<title>{escape(title)}</title>\n<rect width="{width}" height="{height}" fill="white"/>\n{body}\n</svg>\n')
