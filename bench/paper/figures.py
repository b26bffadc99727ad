"""Figures as SVG, drawn with nothing but text: the same numbers give the same bytes."""
import html
import math

COLOURS = {"true": "#000000", "LI": "#d95f02", "LIV": "#e7a400", "KIL": "#1b9e77", "KILV": "#2b6cb0", "KI": "#a03060", "undisturbed": "#2b6cb0",
           "unrecoverable": "#d95f02", "recovered": "#1b9e77", "ours": "#2b6cb0"}
MODALITY_COLOURS = {"KILV": "#2b6cb0", "KIL": "#1b9e77", "KI": "#a03060", "LIV": "#e7a400", "LI": "#d95f02", "COAST": "#777777"}
WIDTH, HEIGHT = 460, 250
LEFT, RIGHT, TOP, BOTTOM = 52, 10, 24, 34


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    if not high > low:
        return [low]
    rough = (high - low) / count
    power = 10 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    return [i * step for i in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def number(x: float) -> str:
    return f"{x:.4g}" if abs(x) > 1e-12 else "0"


class Plot:
    """Axes, lines in them, and a legend."""

    def __init__(self, title: str, x_label: str, y_label: str, x: tuple, y: tuple, height: int = HEIGHT):
        self.x, self.y, self.height = x, y, height
        self.body: list[str] = []
        self.legend: list[tuple[str, str]] = []
        self.head = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" '
                     'font-family="sans-serif" font-size="11">', f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
                     f'<text x="{LEFT}" y="14" font-weight="bold">{html.escape(title)}</text>',
                     f'<text x="{(LEFT + WIDTH - RIGHT) / 2:.0f}" y="{height - 4}" text-anchor="middle">{html.escape(x_label)}</text>',
                     f'<text x="12" y="{height / 2:.0f}" text-anchor="middle" transform="rotate(-90 12 {height / 2:.0f})">{html.escape(y_label)}</text>']

    def px(self, x: float) -> float:
        return LEFT + (x - self.x[0]) / (self.x[1] - self.x[0]) * (WIDTH - LEFT - RIGHT)

    def py(self, y: float) -> float:
        return self.height - BOTTOM - (y - self.y[0]) / (self.y[1] - self.y[0]) * (self.height - TOP - BOTTOM)

    def line(self, points: list, colour: str, width: float = 1.2, dash: str = "") -> None:
        if not points:
            return
        path = " ".join(f"{self.px(x):.1f},{self.py(min(max(y, self.y[0]), self.y[1])):.1f}" for x, y in points)
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self.body.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dashed}/>')

    def band(self, x0: float, x1: float, y0: float, y1: float, colour: str, opacity: float = 1) -> None:
        left, right, top, bottom = self.px(x0), self.px(x1), self.py(y1), self.py(y0)
        self.body.append(f'<rect x="{left:.1f}" y="{top:.1f}" width="{max(0.5, right - left):.1f}" height="{bottom - top:.1f}" fill="{colour}" '
                         f'fill-opacity="{opacity}"/>')

    def text(self, x: float, y: float, text: str) -> None:
        self.body.append(f'<text x="{self.px(x):.1f}" y="{self.py(y):.1f}">{html.escape(text)}</text>')

    def done(self, y_ticks: bool = True, x_ticks: bool = True) -> str:
        frame = [f'<rect x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{self.height - TOP - BOTTOM}" fill="none" stroke="#999999"/>']
        for t in ticks(*self.x) if x_ticks else []:
            frame.append(f'<text x="{self.px(t):.1f}" y="{self.height - BOTTOM + 13}" text-anchor="middle">{number(t)}</text>')
            frame.append(f'<line x1="{self.px(t):.1f}" x2="{self.px(t):.1f}" y1="{TOP}" y2="{self.height - BOTTOM}" stroke="#eeeeee"/>')
        for t in ticks(*self.y) if y_ticks else []:
            frame.append(f'<text x="{LEFT - 4}" y="{self.py(t) + 4:.1f}" text-anchor="end">{number(t)}</text>')
            frame.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{self.py(t):.1f}" y2="{self.py(t):.1f}" stroke="#eeeeee"/>')
        legend, at = [], WIDTH - RIGHT
        for name, colour in reversed(self.legend):
            at -= 7 * len(name) + 16
            legend.append(f'<line x1="{at}" x2="{at + 12}" y1="10" y2="10" stroke="{colour}" stroke-width="2"/><text x="{at + 14}" y="14">'
                          f'{html.escape(name)}</text>')
        return "\n".join(self.head + frame + self.body + legend + ["</svg>"]) + "\n"


def range_of(values: list[float], least: float) -> tuple[float, float]:
    low, high = min(values), max(values)
    room = max(0.05 * (high - low), (least - (high - low)) / 2)
    return low - room, high + room


def against_time(title: str, label: str, curves: dict, least: float, column: int = 1) -> str:
    values = [row[column] for rows in curves.values() for row in rows]
    times = [row[0] for rows in curves.values() for row in rows]
    plot = Plot(title, "time, s", label, (min(times), max(max(times), min(times) + 0.1)), range_of(values, least))
    for name, rows in curves.items():
        plot.line([(row[0], row[column]) for row in rows], COLOURS[name], 1.8 if name == "true" else 1.1)
        plot.legend.append((name, COLOURS[name]))
    return plot.done()


def from_above(title: str, curves: dict) -> str:
    xs = [row[1] for rows in curves.values() for row in rows]
    ys = [row[2] for rows in curves.values() for row in rows]
    x, y = range_of(xs, 0.5), range_of(ys, 0.5)
    height = 330
    # One scale for both axes.
    scale = max((x[1] - x[0]) / (WIDTH - LEFT - RIGHT), (y[1] - y[0]) / (height - TOP - BOTTOM))
    middle = ((x[0] + x[1]) / 2, (y[0] + y[1]) / 2)
    half = (scale * (WIDTH - LEFT - RIGHT) / 2, scale * (height - TOP - BOTTOM) / 2)
    plot = Plot(title, "x, m", "y, m", (middle[0] - half[0], middle[0] + half[0]), (middle[1] - half[1], middle[1] + half[1]), height)
    for name, rows in curves.items():
        plot.line([(row[1], row[2]) for row in rows], COLOURS[name], 1.8 if name == "true" else 1.1)
        plot.legend.append((name, COLOURS[name]))
    return plot.done()


def modality_strip(plot: Plot, changes: list, until: float, low: float, high: float) -> None:
    for (t, name), after in zip(changes, [*(c[0] for c in changes[1:]), until]):
        plot.band(max(0, t), min(until, after), low, high, MODALITY_COLOURS.get(name, "#777777"), 0.8)


def modality_legend(plot: Plot, names: list[str]) -> None:
    plot.legend += [(name, MODALITY_COLOURS[name]) for name in MODALITY_COLOURS if name in names]


def modalities_over_time(title: str, runs: dict, lasts: float) -> str:
    """One strip for each run."""
    plot = Plot(title, "time, s", "", (0, lasts), (0, len(runs)), 60 + 34 * len(runs))
    used: list[str] = []
    for i, (name, changes) in enumerate(runs.items()):
        low = len(runs) - 1 - i
        modality_strip(plot, changes, lasts, low + 0.1, low + 0.6)
        plot.text(0.01 * lasts, low + 0.7, name)
        used += [c[1] for c in changes]
    modality_legend(plot, used)
    return plot.done(y_ticks=False)


def indicator_and_modality(title: str, label: str, values: list, changes: list, lasts: float) -> str:
    high = max([v for _, v in values] + [1e-9]) * 1.15
    plot = Plot(title, "time, s", label, (0, lasts), (0, high))
    modality_strip(plot, changes, lasts, 0.94 * high, high)
    plot.line([(t, v) for t, v in values], "#333333")
    modality_legend(plot, [c[1] for c in changes])
    return plot.done()


def contact_strips(title: str, strips: dict) -> str:
    begin, end = strips["begin"], strips["end"]
    plot = Plot(title, "time, s", "", (begin, end), (0, 4), 150)
    for row, (name, who, side) in enumerate((("left, true", "true", 1), ("left, ours", "ours", 1), ("right, true", "true", 2), ("right, ours", "ours", 2))):
        low = 3 - row
        changes = strips[who]
        for change, after in zip(changes, [*(c[0] for c in changes[1:]), end]):
            if change[side]:
                plot.band(change[0], after, low + 0.15, low + 0.6, COLOURS[who], 0.8)
        plot.text(begin + 0.005 * (end - begin), low + 0.66, name)
    return plot.done(y_ticks=False)


def bars(title: str, label: str, groups: list[tuple[str, list[tuple[str, float]]]], colours: list[str]) -> str:
    """Stacked, one bar for each group."""
    most = max([sum(v for _, v in parts) for _, parts in groups] + [1e-9])
    plot = Plot(title, "", label, (0, max(1, len(groups))), (0, 1.1 * most), 300)
    for i, (name, parts) in enumerate(groups):
        low = 0.0
        for (_, value), colour in zip(parts, colours):
            plot.band(i + 0.2, i + 0.8, low, low + value, colour)
            low += value
        x, y = plot.px(i + 0.5), plot.py(0) + 4
        plot.body.append(f'<text x="{x:.1f}" y="{y:.1f}" font-size="8" transform="rotate(-30 {x:.1f} {y:.1f})" text-anchor="end">{html.escape(name)}</text>')
    if groups:
        plot.legend = [(part, colour) for (part, _), colour in zip(groups[0][1], colours)]
    return plot.done(x_ticks=False)
