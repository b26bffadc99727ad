"""One recording under many circumstances: runs of kilvo and what came of each, as numbers and short curves."""
import bisect
import json
import math
import os
import re
import shutil
import subprocess
import tempfile
import threading

MODALITIES = {"LI": "imu,lidar", "LIV": "imu,lidar,camera", "KIL": "legs,imu,lidar", "KILV": "legs,imu,lidar,camera", "KI": "legs,imu"}
# The paper's robust_h01* lasts 554 s: images end after 350, scans after 500. Its robust_h02* lasts 375 s: each sensor is away for 10 s.
UNRECOVERABLE = (("camera", 350 / 554, None), ("lidar", 500 / 554, None))
RECOVERED = (("legs", 60 / 375, 70 / 375), ("lidar", 150 / 375, 160 / 375), ("camera", 230 / 375, 240 / 375))
# Kind of degradation, and when, as shares of the recording.
DEGRADED = {"dark": (0.4, 0.6), "blank": (0.4, 0.6), "narrow": (0.4, 0.6)}
CURVE_POINTS = 400
TRUSTING = "--trust-description"
WRONG_DESCRIPTION = "the robot's description is wrong"  # as kilvo begins its summary's failure


class Failure(Exception):
    """Something the user can mend; the text says what."""


# Programs that run at the moment, so that an interruption ends them.
_running: set = set()
_lock = threading.Lock()


# By verb of kilvo: how often, CPU seconds.
spent: dict[str, tuple[int, float]] = {}


def output_of(command: list[str]) -> str:
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        try:
            process = subprocess.Popen(command, stdout=out, stderr=err)
        except OSError as error:
            raise Failure(f"{command[0]} cannot be started: {error.strerror}") from error
        with _lock:
            _running.add(process)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        with _lock:
            _running.discard(process)
            times, seconds = spent.get(command[1], (0, 0.0))
            spent[command[1]] = times + 1, seconds + usage.ru_utime + usage.ru_stime
        for file in (out, err):
            file.seek(0)
        if process.returncode != 0:
            tail = "\n".join((err.read() or out.read()).strip().splitlines()[-5:])
            raise Failure(f"`{' '.join(command)}` ended with {process.returncode}:\n{tail}")
        return out.read()


def end_all() -> None:
    with _lock:
        for process in _running:
            process.terminate()


def rows_of(path: str) -> list[list[str]]:
    """Of a CSV file with a head line, or of a TUM file."""
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        lines = [line.strip() for line in file if line.strip() and not line.startswith("#")]
    if lines and lines[0].split(",")[0] == "t":
        lines = lines[1:]
    return [line.replace(",", " ").split() if "," not in line else line.split(",") for line in lines]


def poses_of(path: str) -> list[list[float]]:
    return [[float(word) for word in row] for row in rows_of(path)]


def rotation(q: list[float]) -> list[list[float]]:
    x, y, z, w = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def turned(R: list[list[float]], v: list[float]) -> list[float]:
    return [sum(R[i][k] * v[k] for k in range(3)) for i in range(3)]


def turned_back(R: list[list[float]], v: list[float]) -> list[float]:
    return [sum(R[k][i] * v[k] for k in range(3)) for i in range(3)]


def nearest(poses: list[list[float]], t: float) -> list[float]:
    i = bisect.bisect_left(poses, t, key=lambda row: row[0])
    around = poses[max(0, i - 1):i + 1]
    return min(around, key=lambda row: abs(row[0] - t))


def way_of(truth: list[list[float]], begin: float, end: float) -> float:
    way, before = 0.0, None
    for row in truth:
        if begin <= row[0] <= end and (before is None or row[0] - before[0] >= 0.05):
            if before:
                way += math.dist(row[1:4], before[1:4])
            before = row
    return way


def drift(estimate: list[list[float]], truth: list[list[float]], begin: float) -> dict | None:
    """From the pose at `begin` to the end: what is wrong then, in percent of the true way since."""
    e0, e1 = nearest(estimate, begin), estimate[-1]
    g0, g1 = nearest(truth, e0[0]), nearest(truth, e1[0])
    way = way_of(truth, g0[0], g1[0])
    if way < 0.3:
        return None
    body = turned_back(rotation(e0[4:8]), [b - a for a, b in zip(e0[1:4], e1[1:4])])
    error = [a - (g1[i + 1] - g0[i + 1]) for i, a in enumerate(turned(rotation(g0[4:8]), body))]
    return {"xy": 100 * math.hypot(error[0], error[1]) / way, "z": 100 * abs(error[2]) / way, "way": way}


def thinned(rows: list, most: int = CURVE_POINTS) -> list:
    step = max(1, math.ceil(len(rows) / most))
    return rows[::step]


class Outcome:
    """What one run of kilvo left in its folder."""

    def __init__(self, trials: "Trials", folder: str, sensors: str):
        self.trials, self.folder, self.sensors = trials, folder, sensors
        with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
            self.summary = json.load(file)
        # Legs and IMU alone have no sweeps.
        self.poses_file = os.path.join(folder, "sweeps.tum" if "lidar" in sensors else "odometry.tum")

    def errors(self, align: str) -> dict:
        return json.loads(output_of([self.trials.kilvo, "eval", self.poses_file, self.trials.recording["truth"], "--align", align, "--json"]))

    def drift(self, begin: float | None = None) -> dict | None:
        estimate = poses_of(os.path.join(self.folder, "odometry.tum"))
        return drift(estimate, self.trials.truth, estimate[0][0] if begin is None else begin)

    def end_error(self) -> float:
        """End to end, mm, of the output at the encoders' rate."""
        file = os.path.join(self.folder, "odometry.tum")
        return 1e3 * json.loads(output_of([self.trials.kilvo, "eval", file, self.trials.recording["truth"], "--align", "first", "--json"]))["e2e_m"]

    def modalities(self) -> list[tuple[float, str]]:
        rows = rows_of(os.path.join(self.folder, "modality.csv"))
        return [(float(row[0]) - self.trials.begin, row[1]) for row in rows]

    def curve(self) -> list[list[float]]:
        """t, x, y, z in the truth's world, the first poses laid over each other with z upwards in both."""
        estimate = thinned(poses_of(self.poses_file))
        first = estimate[0]
        true = nearest(self.trials.truth, first[0])
        R_e, R_g = rotation(first[4:8]), rotation(true[4:8])
        # The heading between the two worlds: of R_g R_e', about z.
        c = sum(R_g[0][k] * R_e[0][k] + R_g[1][k] * R_e[1][k] for k in range(3))
        s = sum(R_g[1][k] * R_e[0][k] - R_g[0][k] * R_e[1][k] for k in range(3))
        c, s = c / math.hypot(c, s), s / math.hypot(c, s)
        out = []
        for row in estimate:
            d = [a - b for a, b in zip(row[1:4], first[1:4])]
            out.append([row[0] - self.trials.begin, true[1] + c * d[0] - s * d[1], true[2] + s * d[0] + c * d[1], true[3] + d[2]])
        return out

    def speed(self) -> list[list[float]]:
        rows = thinned(rows_of(os.path.join(self.folder, "states.csv")))
        return [[float(r[0]) - self.trials.begin, math.hypot(float(r[1]), float(r[2])), float(r[3])] for r in rows]

    def indicators(self) -> dict:
        """t and value of what Fig. 10 of the paper shows: the points' ratio of eigenvalues, the number of visual points."""
        out: dict = {"ratio": [], "points": []}
        for row in rows_of(os.path.join(self.folder, "degradation.csv")):
            t = float(row[0]) - self.trials.begin
            if row[1]:
                out["ratio"].append([t, float(row[1])])
            if row[3]:
                out["points"].append([t, float(row[3])])
        return {name: thinned(values) for name, values in out.items()}

    def contacts(self, begin: float, end: float) -> list[list[float]]:
        rows = rows_of(os.path.join(self.folder, "contacts.csv"))
        return changes_of([[float(r[0]) - self.trials.begin, int(r[1]), int(r[2])] for r in rows], begin, end)


def changes_of(rows: list[list[float]], begin: float, end: float) -> list[list[float]]:
    out: list[list[float]] = []
    for row in rows:
        if begin <= row[0] <= end and (not out or row[1:3] != out[-1][1:3]):
            out.append(row)
    return out


class Trials:
    """Of one recording. A run is made once, however many tables ask for it."""

    def __init__(self, kilvo: str, recording: dict, scratch: str, settings: list[str], duration: float | None,
                 sensors: str | None = None):
        """`sensors`: those in the recording, where it has fewer than the configuration."""
        self.kilvo, self.recording, self.scratch, self.settings, self.duration = kilvo, recording, scratch, settings, duration
        self.truth = poses_of(recording["truth"])
        if not self.truth:
            raise Failure(f"{recording['truth']} has no pose")
        self._known: dict = {}
        self.distrusted: list[str] = []  # runs that kilvo itself ends as failed, and why
        with open(recording["config"], encoding="utf-8") as file:
            sections = sensors.split(",") if sensors else {line.split(":")[0] for line in file if line[:1].isalpha()}
        self.modalities = [m for m, sensors in MODALITIES.items() if all(s in sections for s in sensors.split(","))]
        self._begin: float | None = None

    def _run(self, modality: str, words: tuple, out: str) -> Outcome:
        command = [self.kilvo, "run", self.recording["bag"], "--out", out, "--config", self.recording["config"], "--sensors", MODALITIES[modality], "--no-map",
                   "--quiet", "--threads", "1"]
        if self.duration:
            command += ["--duration", f"{self.duration:g}"]
        for setting in self.settings:
            command += ["--set", setting]
        try:
            output_of(command + list(words))
        except Failure:
            # A run whose end kilvo does not trust has all its files, and is judged like any other.
            if not os.path.exists(os.path.join(out, "summary.json")):
                raise
        return Outcome(self, out, MODALITIES[modality])

    def run(self, modality: str, words: tuple = ()) -> Outcome:
        key = (modality, words)
        if key not in self._known:
            out = os.path.join(self.scratch, str(len(self._known)))
            # The description is judged with all sensors, also while they fail. It takes longer than the run itself: once is enough.
            judged = modality == self.fullest and (not words or words[0] == "--drop")
            outcome = self._run(modality, words if judged else (*words, TRUSTING), out)
            said = outcome.summary.get("failure")
            if said:
                self.distrusted.append(f"{modality}{' ' if words else ''}{' '.join(words)}: {said}")
            if judged and said and said.startswith(WRONG_DESCRIPTION):
                # What is left then is of fewer sensors than the table says, or of another description than its other columns.
                outcome = self._run(modality, (*words, TRUSTING), out)
            self._known[key] = outcome
        return self._known[key]

    def with_settings(self, modality: str, settings: list[str], words: tuple = ()) -> Outcome:
        return self.run(modality, tuple(word for setting in settings for word in ("--set", setting)) + words)

    @property
    def fullest(self) -> str:
        return next(m for m in ("KILV", "KIL", "LIV", "LI", "KI") if m in self.modalities)

    @property
    def lasts(self) -> float:
        return self.run(self.fullest).summary["data_seconds"]

    @property
    def begin(self) -> float:
        if self._begin is None:
            self._begin = self.run(self.fullest).summary["first_pose"]["t"]
        return self._begin

    def drops(self, losses: tuple) -> tuple:
        """As words for kilvo; of sensors that there are."""
        words: list[str] = []
        for sensor, begin, end in losses:
            if sensor in MODALITIES[self.fullest].split(","):
                words += ["--drop", f"{sensor}:{begin * self.lasts:.2f}-" + (f"{end * self.lasts:.2f}" if end else "")]
        return tuple(words)

    def forget(self) -> None:
        shutil.rmtree(self.scratch, ignore_errors=True)

    # What the tables need of this recording, each as plain values.

    def accuracy(self) -> dict:
        out = {}
        for modality in self.modalities:
            outcome = self.run(modality)
            out[modality] = {align: outcome.errors(align) for align in ("se3", "yaw")}
            if modality == "KI":
                out["drift"] = outcome.drift()
        return out

    def times(self) -> dict:
        summaries = {m: self.run(m).summary for m in ("KIL", self.fullest) if m in self.modalities}
        return {m: {"frame_ms": s["mean_ms_per_frame"], "stages": s["stage_us"], "memory_mb": s["peak_memory_mb"]} for m, s in summaries.items()}

    def paths(self) -> dict:
        curves = {m: self.run(m).curve() for m in self.modalities}
        until = self.begin + self.lasts
        rows = [row for row in self.truth if self.begin <= row[0] <= until]
        speeds = []
        step = max(1, len(rows) // CURVE_POINTS)
        for i in range(step, len(rows) - step, step):
            a, b = rows[max(0, i - 25)], rows[min(len(rows) - 1, i + 25)]
            dt = b[0] - a[0]
            speeds.append([rows[i][0] - self.begin, math.hypot(b[1] - a[1], b[2] - a[2]) / dt, (b[3] - a[3]) / dt])
        return {"true": [[r[0] - self.begin, *r[1:4]] for r in thinned(rows)], "curves": curves, "true_speed": speeds,
                "speed": self.run(self.fullest).speed()}

    def contact_strips(self) -> dict | None:
        if not os.path.exists(self.recording["contacts"]) or "KIL" not in self.modalities:
            return None
        begin, end = 0.45 * self.lasts, min(0.45 * self.lasts + 6, self.lasts)
        true = [[float(r[0]) - self.begin, int(float(r[1])), int(float(r[2]))] for r in rows_of(self.recording["contacts"])]
        return {"begin": begin, "end": end, "true": changes_of(true, begin, end), "ours": self.run("KIL").contacts(begin, end)}

    def failures(self) -> dict:
        full = self.run(self.fullest)
        out = {"lasts": self.lasts, "undisturbed": full.end_error(), "paths": {"undisturbed": full.curve()}, "modalities": {}}
        for name, losses in (("unrecoverable", UNRECOVERABLE), ("recovered", RECOVERED)):
            outcome = self.run(self.fullest, self.drops(losses))
            out[name] = outcome.end_error()
            out["paths"][name] = outcome.curve() if name == "recovered" else outcome_curve_of_outputs(outcome)
            out["modalities"][name] = outcome.modalities()
            if name == "unrecoverable" and "lidar" in full.sensors and "legs" in full.sensors:
                out["drift"] = outcome.drift(self.begin + UNRECOVERABLE[1][1] * self.lasts)
        return out

    def degradation(self) -> dict:
        full = self.run(self.fullest)
        out = {"lasts": self.lasts, "as it is": {"ate": full.errors("se3")["ate_rmse_m"], "e2e": full.end_error(), "modalities": full.modalities(),
                                                 "indicators": full.indicators()}}
        for kind, (begin, end) in DEGRADED.items():
            if (kind != "narrow" and "camera" not in full.sensors) or "lidar" not in full.sensors:
                continue
            outcome = self.run(self.fullest, ("--degrade", f"{kind}:{begin * self.lasts:.2f}-{end * self.lasts:.2f}"))
            out[kind] = {"ate": outcome.errors("se3")["ate_rmse_m"], "e2e": outcome.end_error(), "modalities": outcome.modalities(),
                         "indicators": outcome.indicators()}
        return out

    def compared(self, settings: list[str], columns: list[str]) -> dict:
        """What other settings make of it: ATE of two modalities, mm, drift of legs and IMU from the start and since the LiDAR was lost, end-to-end error, mm,
        with failures that recover."""
        out: dict = {}
        for column in columns:
            if column in ("KIL", "KILV") and column in self.modalities:
                out[column] = 1e3 * self.with_settings(column, settings).errors("se3")["ate_rmse_m"]
            elif column == "KI" and "KI" in self.modalities:
                out[column] = self.with_settings("KI", settings).drift()
            elif column == "lost" and "KIL" in self.modalities:
                lost = self.with_settings(self.fullest, settings, self.drops(UNRECOVERABLE))
                out[column] = lost.drift(self.begin + UNRECOVERABLE[1][1] * self.lasts)
            elif column == "recovered":
                out[column] = self.with_settings(self.fullest, settings, self.drops(RECOVERED)).end_error()
        return out


def cut_to(kilvo: str, walk: str, most: float | None, folder: str) -> list[str]:
    """As words for kilvo simulate, whose --duration would let a walk that is over stand on."""
    if most is None:
        return []
    # Without images and scans a matter of a second.
    with tempfile.TemporaryDirectory(dir=folder) as made:
        said = output_of([kilvo, "simulate", walk, "--out", os.path.join(made, "walk"), "--sensors", "imu"])
    return ["--duration", f"{most:g}"] if float(re.search(r": ([0-9.]+) s of '", said).group(1)) > most else []


def legs_alone(kilvo: str, walk: str, seed: int, level: int, until_lost: bool, length: list[str], folder: str, settings: list[str]) -> dict | None:
    """Drift of legs and IMU alone on a walk that is made for it, of a robot as it is described (level 0) or one that is kept well (1): from the
    start, or `until_lost` with a LiDAR, as long before the end as the paper loses it for good."""
    made = os.path.join(folder, f"legs_{walk}_{seed}_{level}_{until_lost:d}")
    sensors = MODALITIES["KIL" if until_lost else "KI"]
    output_of([kilvo, "simulate", walk, "--out", made, "--seed", str(seed), "--rough", str(level), *length, "--sensors", sensors, "--quiet"])
    recording = {"bag": os.path.join(made, "recording.bag"), "truth": os.path.join(made, "gt.tum"), "config": os.path.join(made, "config.yaml")}
    try:
        of = Trials(kilvo, recording, os.path.join(made, "runs"), settings, None, sensors)
        return of.run("KIL", of.drops(UNRECOVERABLE)).drift(of.begin + UNRECOVERABLE[1][1] * of.lasts) if until_lost else of.run("KI").drift()
    finally:
        shutil.rmtree(made, ignore_errors=True)


def outcome_curve_of_outputs(outcome: Outcome) -> list[list[float]]:
    """As curve(), of every output: after the LiDAR is lost there are no sweeps."""
    sweeps, outcome.poses_file = outcome.poses_file, os.path.join(outcome.folder, "odometry.tum")
    out = outcome.curve()
    outcome.poses_file = sweeps
    return out
