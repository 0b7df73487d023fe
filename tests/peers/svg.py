"""Line charts as SVG: axes linear or logarithmic, lines, steps, markers, a legend. No dependency."""
import math
from xml.sax.saxutils import escape

# Okabe and Ito's colours, which colour-blind readers can tell apart; the last line styles repeat them dashed.
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"]
DASHES = ["", "6 3", "2 3"]


class Axis:
    def __init__(self, label, log=False, low=None, high=None):
        self.label, self.log, self.low, self.high = label, log, low, high

    def fit(self, values):
        values = [v for v in values if math.isfinite(v) and (v > 0 or not self.log)]
        self.low = min(values, default=1.0) if self.low is None else self.low
        self.high = max(values, default=10.0) if self.high is None else self.high
        if self.high <= self.low:
            self.high = self.low * 10 if self.log else self.low + 1

    def shows(self, value):
        return math.isfinite(value) and (value > 0 or not self.log)

    def share(self, value):
        """Where a value lies between the ends, 0 to 1."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def ticks(self):
        if not self.log:
            step = 10 ** math.floor(math.log10((self.high - self.low) / 2))
            while (self.high - self.low) / step > 8:
                step *= 2.5 if f"{step:e}"[0] == "2" else 2
            first = math.ceil(self.low / step - 1e-9)
            return [k * step for k in range(first, math.floor(self.high / step + 1e-9) + 1)]
        low, high = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
        decades = [10.0 ** k for k in range(low, high + 1, max(1, math.ceil((high - low) / 9)))]
        return decades if len(decades) > 1 else [self.low, self.high]


class Chart:
    def __init__(self, title, x, y, width=760, height=460):
        self.title, self.x, self.y, self.width, self.height = title, x, y, width, height
        self.lines = []

    def line(self, name, points, step=False, markers=False):
        """Points that an axis can't show are left out. step: each value holds until the next point."""
        self.lines.append((name, list(points), step, markers))

    def _place(self, point):
        left, right, top, bottom = 70, 200, 36, 50
        return (left + (self.width - left - right) * self.x.share(point[0]),
                self.height - bottom - (self.height - top - bottom) * self.y.share(point[1]))

    def _axes(self):
        (x0, y0), (x1, y1) = self._place((self.x.low, self.y.low)), self._place((self.x.high, self.y.high))
        out = [f'<rect x="{x0:.1f}" y="{y1:.1f}" width="{x1 - x0:.1f}" height="{y0 - y1:.1f}" fill="none" stroke="#444"/>']
        for tick in self.x.ticks():
            at = self._place((tick, self.y.low))[0]
            out.append(f'<path d="M{at:.1f} {y0:.1f}V{y1:.1f}" stroke="#ddd"/>'
                       f'<text x="{at:.1f}" y="{y0 + 16:.1f}" text-anchor="middle">{tick:.6g}</text>')
        for tick in self.y.ticks():
            at = self._place((self.x.low, tick))[1]
            out.append(f'<path d="M{x0:.1f} {at:.1f}H{x1:.1f}" stroke="#ddd"/>'
                       f'<text x="{x0 - 6:.1f}" y="{at + 4:.1f}" text-anchor="end">{tick:.6g}</text>')
        out.append(f'<text x="{(x0 + x1) / 2:.1f}" y="{self.height - 12}" text-anchor="middle">{escape(self.x.label)}</text>')
        out.append(f'<text transform="translate(16 {(y0 + y1) / 2:.1f}) rotate(-90)" text-anchor="middle">'
                   f'{escape(self.y.label)}</text>')
        return out

    def _line(self, k, name, points, step, markers):
        colour, dash = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
        places = [self._place(p) for p in points if self.x.shows(p[0]) and self.y.shows(p[1])]
        path = ""
        for j, (x, y) in enumerate(places):
            path += f"M{x:.1f} {y:.1f}" if j == 0 else f"H{x:.1f}V{y:.1f}" if step else f"L{x:.1f} {y:.1f}"
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        out = [f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.6"{dashed}/>'] if path else []
        if markers:
            out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{colour}"/>' for x, y in places]
        x, y = self.width - 190, 46 + 17 * k
        out.append(f'<path d="M{x} {y - 4}h24" stroke="{colour}" stroke-width="1.6"{dashed}/>'
                   f'<text x="{x + 30}" y="{y}">{escape(name)}</text>')
        return out

    def text(self):
        self.x.fit([p[0] for line in self.lines for p in line[1]])
        self.y.fit([p[1] for line in self.lines for p in line[1]])
        out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" '
               'font-family="sans-serif" font-size="12">',
               f'<rect width="{self.width}" height="{self.height}" fill="white"/>',
               f'<text x="{self.width / 2}" y="20" text-anchor="middle" font-size="14">{escape(self.title)}</text>']
        out += self._axes()
        for k, line in enumerate(self.lines):
            out += self._line(k, *line)
        return "\n".join([*out, "</svg>", ""])

    def write(self, path):
        with open(path, "w") as file:
            file.write(self.text())
