"""The tables of the paper from what trials.py found, as heads and rows of text."""
import math

MODALITIES = ["LI", "LIV", "KIL", "KILV", "KI"]
LEVELS = {0: "as described", 1: "kept well"}
COMPARED = ["KIL", "KILV", "KI", "lost", "recovered"]

# What is changed, by which settings, and what that can change.
ABLATIONS = [("as it is", [], COMPARED), ("without the height row", ["legs.height=never"], ["KI", "lost"]),
             ("without noise adaptation", ["legs.adaptation=none"], ["KIL", "KI"]), ("without settling", ["estimator.settling=none"], ["recovered"]),
             ("without a new exposure at each image", ["camera.adapt_exposure=false", "camera.exposure_walk=0"], ["KILV"]),
             ("without new reference views", ["camera.new_views=false"], ["KILV"]), ("without velocity noise", ["imu.velocity_noise=0"], ["KIL", "KI"])]
VARIANTS = [("as it is", [], COMPARED),
            ("kinematic update iterated", ["legs.iterations=5"], ["KIL", "KI"]), ("Eq. 8 for each row", ["legs.adaptation=row"], ["KIL", "KI"]),
            ("height row in every modality", ["legs.height=always"], ["KIL"]), ("ground of the contacts alone", ["legs.ground=contacts"], ["KI", "lost"])]


def millimetres(metres: float) -> str:
    return f"{1e3 * metres:.2f}" if metres < 1 else f"{1e3 * metres:.0f}"


def signed(x: float) -> str:
    return f"{round(x, 1) + 0.0:+.1f}"


def geometric_mean(values: list[float]) -> float:
    return math.exp(sum(math.log(max(v, 1e-9)) for v in values) / len(values)) if values else math.nan


def mean(values: list[float]) -> float:
    return sum(values) / len(values) if values else math.nan


class Table:
    def __init__(self, title: str, heads: list[str], rows: list[list[str]], note: str = ""):
        self.title, self.heads, self.rows, self.note = title, heads, rows, note

    def markdown(self) -> str:
        lines = [f"**{self.title}**", ""] + ([self.note, ""] if self.note else [])
        lines += ["| " + " | ".join(self.heads) + " |", "|" + "---|" * len(self.heads)]
        return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in self.rows]) + "\n"


def by_modality(title: str, results: dict, value, text, note: str = "") -> Table:
    """`value(errors of the modality)`; the mean of those columns that every recording has."""
    shown = [m for m in MODALITIES if any(m in r["accuracy"] for r in results.values())]
    rows, columns = [], {m: [] for m in shown}
    for name, result in results.items():
        row = [name]
        for m in shown:
            of = result["accuracy"].get(m)
            known = of is not None and value(of) is not None
            row.append(text(value(of)) + (" x" if of["se3"]["diverged"] else "") if known else "-")
            if known:
                columns[m].append(value(of))
        rows.append(row)
    rows.append(["mean"] + [text(mean(columns[m])) if len(columns[m]) == len(results) else "-" for m in shown])
    return Table(title, ["recording", *shown], rows, note)


def accuracy(results: dict) -> list[Table]:
    out = [by_modality(f"Table III: ATE RMSE after {name} alignment, mm", results, lambda of, a=align: of[a]["ate_rmse_m"], millimetres,
                       "At the sweeps, as the paper's; of KI at every leg sample. x: diverged.")
           for align, name in (("se3", "SE(3)"), ("yaw", "yaw (position and heading)"))]
    out.append(by_modality("Table III: RTE over 1 m, % of the distance", results, lambda of: of["se3"]["rte_1m_percent"], lambda v: f"{v:.3f}"))
    out.append(by_modality("Table IV: end-to-end translation error, mm", results, lambda of: of["se3"]["e2e_m"], millimetres,
                           "No alignment enters: the true and the estimated displacement, each in its first body frame."))
    out.append(by_modality("Table III: end-to-end error along z, mm", results, lambda of: abs(of["se3"]["e2e_z_m"]), millimetres))
    rows = []
    for name, result in results.items():
        d = result["accuracy"].get("drift")
        if d:
            rows.append([name, f"{d['way']:.1f}", f"{d['xy']:.2f}", f"{d['z']:.2f}"])
    if rows:
        rows.append(["mean", "", f"{mean([float(r[2]) for r in rows]):.2f}", f"{mean([float(r[3]) for r in rows]):.2f}"])
        out.append(Table("Legs and IMU alone from the start (KI): error at the end, % of the distance", ["recording", "distance, m", "horizontal", "vertical"], rows,
                         "No scan and no map, ever. Recordings of less than 0.3 m of distance are left out."))
    return out


def times(results: dict) -> list[Table]:
    """Table V, and by module."""
    rows, parts = [], []
    for name, result in results.items():
        for modality, of in result["times"].items():
            stages = of["stages"]

            def cell(stage: str, scale: float, digits: int) -> str:
                s = stages.get(stage)
                return f"{scale * s['p50']:.{digits}f} / {scale * s['p99']:.{digits}f}" if s else "-"

            rows.append([name, modality, f"{of['frame_ms']:.2f}", f"{of['memory_mb']:.0f}"])
            parts.append([name, modality, cell("contact", 1, 1), cell("kinematic", 1, 1), cell("lidar", 1e-3, 2), cell("map", 1e-3, 2), cell("visual", 1e-3, 2)])
    return [Table("Table V: mean time of a frame with all that belongs to it, ms; peak memory, MB", ["recording", "modality", "ms", "MB"], rows,
                  "As the paper counts it: the asynchronous phases of one scan period and its sequential phase; one thread, beside what else ran."),
            Table("Time by module: p50 / p99", ["recording", "modality", "contacts, us", "leg sample, us", "LiDAR, ms", "map, ms", "image, ms"], parts,
                  "A leg sample's time contains its contacts'.")]


def failures(results: dict) -> list[Table]:
    rows, more, drifts = [], [], []
    for name, result in results.items():
        f = result["failures"]
        d = f.get("drift")
        way = f"{d['xy']:.2f} / {d['z']:.2f} of {d['way']:.1f} m" if d else "-"
        more.append(f["recovered"] - f["undisturbed"])
        drifts += [d] if d else []
        rows.append([name, f"{f['undisturbed']:.1f}", f"{f['recovered']:.1f}", signed(more[-1]), f"{f['unrecoverable']:.1f}", way])
    largest = " / ".join(f"{max(d[k] for d in drifts):.2f}" for k in ("xy", "z")) if drifts else "-"
    rows.append(["largest", "", "", signed(max(more)), "", largest])
    return [Table("Failures: end-to-end error of the last output, mm",
                  ["recording", "undisturbed", "recovered", "more than undisturbed", "not recovered", "drift since the LiDAR was lost, % xy / z"], rows,
                  "The paper's losses at the same shares of the recording. Recovered (robust_h02*): legs 16 to 19 %, LiDAR 40 to 43 %, images 61 to 64 %. "
                  "Not recovered (robust_h01*): images from 63 %, LiDAR from 90 % to the end, in KI.")]


def legs_alone(found: list[dict]) -> list[Table]:
    robots = ("As described: the robot is what its description says. Kept well: its legs, mounts, clocks and soles are a little otherwise "
              "(`kilvo simulate --rough 1`).")
    both = [drifts([f for f in found if not f["until_lost"]], "Legs and IMU alone (KI) from the start: error at the end, % of the distance",
                   "No scan and no map, ever. " + robots),
            drifts([f for f in found if f["until_lost"]], "Unrecoverable failure on the same walks: error at the end, % of the distance since the LiDAR was lost",
                   "No camera; the LiDAR is lost for good at the paper's share of the recording. On a distance of a metre or less the first millimetres, "
                   "which do not grow with it, are most of the error (Failures).")]
    return [table for table in both if table.rows]


def drifts(found: list[dict], title: str, note: str) -> Table:
    rows = []
    for level in sorted({f["level"] for f in found}):
        of = [f for f in found if f["level"] == level]
        rows += [[f["walk"], str(f["seed"]), LEVELS[level], f"{f['way']:.1f}", f"{f['xy']:.2f}", f"{f['z']:.2f}"] for f in of]
        for word, take in (("mean", mean), ("largest", max)):
            rows.append([word, "", LEVELS[level], "", f"{take([f['xy'] for f in of]):.2f}", f"{take([f['z'] for f in of]):.2f}"])
    return Table(title, ["walk", "seed", "robot", "distance, m", "horizontal", "vertical"], rows, note)


def degradation(results: dict) -> list[Table]:
    kinds = [("as it is", "as it is"), ("dark", "images at 1/30 of the light"), ("blank", "images without texture"), ("narrow", "scans of 30 degrees")]
    rows = []
    for name, result in results.items():
        d = result["degradation"]
        rows.append([name] + [f"{1e3 * d[k]['ate']:.2f} / {d[k]['e2e']:.1f}" if k in d else "-" for k, _ in kinds])
    return [Table("Degradation from 40 to 60 % of the recording: ATE (SE(3)) / end-to-end error, mm", ["recording", *(text for _, text in kinds)], rows,
                  "All sensors there are. What is degraded is at each moment in the figures.")]


def measures_of(compared: dict) -> dict:
    """By column; mm, and % of the distance for the drifts."""
    out = {}
    for column in COMPARED:
        value = compared.get(column)
        if isinstance(value, dict):
            out[column + " xy"], out[column + " z"] = value["xy"], value["z"]
        elif value is not None:
            out[column] = value
    return out


HEADS = {"KIL": "KIL, ATE mm", "KILV": "KILV, ATE mm", "KI xy": "KI, % xy", "KI z": "KI, % z", "lost xy": "LiDAR lost, % xy", "lost z": "LiDAR lost, % z",
         "recovered": "recovered, mm"}
# Below these nothing is compared: the difference is chance.
LEAST = {"KIL": 0.05, "KILV": 0.05, "KI xy": 0.02, "KI z": 0.02, "lost xy": 0.05, "lost z": 0.05, "recovered": 0.5}


def comparison(title: str, results: dict, key: str, choices: list, note: str) -> list[Table]:
    shown = [c for c in HEADS if any(c in measures_of(r[key][choices[0][0]]) for r in results.values())]
    rows = []
    for name, settings, _ in choices:
        row = [name, " ".join(settings) or "-"]
        for column in shown:
            pairs = []
            for result in results.values():
                base, other = measures_of(result[key][choices[0][0]]), measures_of(result[key][name])
                if column in base and column in other:
                    pairs.append((max(base[column], LEAST[column]), max(other[column], LEAST[column])))
            # The geometric mean, which no single recording rules.
            level = geometric_mean([b for _, b in pairs])
            ratio = geometric_mean([b / a for a, b in pairs])
            row.append("-" if not pairs else f"{level:.2f}" + (f" (x {ratio:.2f})" if settings else ""))
        rows.append(row)
    out = [Table(title, ["what", "settings", *(HEADS[c] for c in shown)], rows, note)]
    each = []
    for recording, result in results.items():
        for name, _, _ in choices:
            m = measures_of(result[key][name])
            each.append([recording, name] + [f"{m[c]:.2f}" if c in m else "-" for c in shown])
    out.append(Table(title + ": each recording", ["recording", "what", *(HEADS[c] for c in shown)], each))
    return out
