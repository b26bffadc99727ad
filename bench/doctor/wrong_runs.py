#!/usr/bin/python3
"""What `kilvo run` makes of wrong descriptions: refused, reported, or a wrong trajectory that nobody was warned of.

  wrong_runs.py KILVO RECORDING CONFIG TRUTH [--only TEXT] [--data] [--sensors LIST]

The cases are those of confusion.py. TRUTH is a trajectory (TUM) of the IMU. A run is silently wrong when it ends with exit status 0,
reports nothing of the description or of a sensor left out, and its error exceeds both 5 cm and four times its own sigma (or, in the
mean, ten times the error of the right description and 3 cm). Exit status 1 when a run is silently wrong or the right description is refused."""
import argparse
import csv
import json
import os
import re
import subprocess
import sys
import tempfile

import numpy as np
import yaml

from confusion import data_cases, description_cases, rewrite

# Reasons of events (events.csv) by which a run says that its description or a sensor is not to be trusted.
REPORTED = re.compile("description|diverged|refused|contradict|left out|doubt|disagree|wrong|lost|offset|clock|of data:", re.I)


def read_tum(path):
    return np.loadtxt(path, ndmin=2) if os.path.getsize(path) else np.zeros((0, 8))


def rotation_of(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def errors(folder, truth):
    """position errors (m), the first poses aligned, and sigma of the position relative to the start; nothing when there are no poses"""
    paths = [os.path.join(folder, name) for name in ("sweeps.tum", "odometry.tum")]
    poses = next((p for p in (read_tum(path) for path in paths if os.path.exists(path)) if len(p) > 1), np.zeros((0, 8)))
    if len(poses) < 2:
        return np.zeros(0), np.zeros(0)
    true = np.column_stack([np.interp(poses[:, 0], truth[:, 0], truth[:, i]) for i in range(1, 8)])
    E, T = rotation_of(poses[0, 4:]), rotation_of(true[0, 3:] / np.linalg.norm(true[0, 3:]))
    moved = (poses[:, 1:4] - poses[0, 1:4]) @ E @ T.T
    e = np.linalg.norm(moved - (true[:, :3] - true[0, :3]), axis=1)
    rows = list(csv.DictReader(open(os.path.join(folder, "states.csv"))))
    t = np.array([float(r["t"]) for r in rows])
    s = np.array([np.sqrt(sum(float(r[k]) ** 2 for k in ("spx", "spy", "spz"))) for r in rows])
    return e, np.interp(poses[:, 0], t, s)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("kilvo", "recording", "config", "truth"):
        parser.add_argument(name)
    parser.add_argument("--only", default="", help="only cases whose name holds this text (a regular expression); the right one comes first always")
    parser.add_argument("--data", action="store_true", help="faults of the messages instead of the configuration")
    parser.add_argument("--sensors", help="as for kilvo run")
    parser.add_argument("--until", type=float, default=30, help="seconds of the recording that are used")
    a = parser.parse_args()
    config = yaml.safe_load(open(a.config))
    work = tempfile.mkdtemp(prefix="wrong-runs-")
    truth = read_tum(a.truth)
    cases = description_cases(config, os.path.dirname(os.path.abspath(a.config)), work)
    cases = cases[:1] + [(n, None, r, change) for n, change, r in data_cases(config)] if a.data else cases
    usual, silent = None, []
    for name, overrides, right, *change in cases:
        if right and not re.search(a.only, name):
            continue
        recording = a.recording
        if change:
            recording = os.path.join(work, "case.bag")
            topics = {s: config[s]["topic"] for s in ("imu", "legs", "lidar", "camera") if s in config}
            rewrite(a.recording, recording, config, change[0], topics, a.until)
        folder = os.path.join(work, "out")
        command = [a.kilvo, "run", recording, "--config", a.config, "--out", folder, "--quiet", "--duration", str(a.until)]
        command += ["--sensors", a.sensors] if a.sensors else []
        for text in overrides or []:
            command += ["--set", text]
        subprocess.run(["rm", "-rf", folder])
        done = subprocess.run(command, capture_output=True, text=True)
        said = [line for line in done.stderr.splitlines() if "warning" in line or "error" in line]
        first = None
        events = os.path.join(folder, "events.csv")
        e, s = errors(folder, truth) if os.path.exists(folder) else (np.zeros(0), np.zeros(0))
        ate = float(np.sqrt(np.mean(e ** 2))) if len(e) else 0.0
        most = float(e.max()) if len(e) else 0.0
        if usual is None:
            usual = ate
        if os.path.exists(events):
            rows = list(csv.DictReader(open(events)))
            begin = float(rows[0]["t"]) if rows else 0
            first = next((float(r["t"]) - begin for r in rows if r["reason"] not in ("start", "camera_used") and REPORTED.search(r["reason"] + r["text"])), None)
        ratio = float((e / np.maximum(s, 1e-4)).max()) if len(e) else 0.0
        wrong = (most > 0.05 and ratio > 4) or ate > max(0.03, 10 * usual)
        reported = done.returncode != 0 or any(REPORTED.search(line) for line in said)
        verdict = "nothing" if not len(e) else "right" if not wrong else "reported" if reported else "SILENT"
        if verdict == "SILENT" or (not right and done.returncode):
            silent.append(name)
        print(f"{verdict:8} {name:34} exit {done.returncode} ate {1000 * ate:9.1f} mm max {1000 * most:9.1f} mm, at most {ratio:6.1f} sigma,"
              f" first event {'-' if first is None else format(first, '.1f')} s", flush=True)
        for line in said[:4]:
            print("           " + line[:200], flush=True)
    print(f"{len(silent)} silently wrong: {', '.join(silent) or '-'}")
    return 1 if silent else 0


if __name__ == "__main__":
    sys.exit(main())
