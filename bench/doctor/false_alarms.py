#!/usr/bin/python3
"""Right descriptions that `kilvo doctor` or the judgement within `kilvo run` accuses.

  false_alarms.py KILVO [--scenarios LIST] [--seeds LIST] [--senses LIST] [--cuts LIST] [--wear TEXT ...] [--run] [--only TEXT]
  false_alarms.py KILVO --recording BAG CONFIG [--recording ...] [--cuts LIST] [--run]

Each scenario is simulated once per seed and set of senses, and judged by cuts of it (START+DURATION, s). --wear gives options of `kilvo
simulate` under which the description stays right ("--leg-rate 100 --imu-rate 100"); each is tried beside none. With --recording,
recordings are judged whose description is known to be right. --run: `kilvo run` too, which must end with exit status 0, accuse nothing
and leave no sense out. Prints a row for each accusation and one for each set of senses; exit status 1 when something right was accused."""
import argparse
import collections
import json
import os
import re
import subprocess
import sys
import tempfile

SCENARIOS = ("room,stand,in_place,forward,backward,fwd_bwd,sideways,spin,square,lifts,fast_walk,rolling,slip,soft,run_room,corridor,"
             "corridor_blank,blank_wall,yard,robust,tiles,slope,run,emergency_stop,stairs")
SENSES = {"k": "legs", "i": "imu", "l": "lidar", "v": "camera"}
NO_VERDICT = re.compile("ends after .*, before --start|nothing was estimated: still waiting")
ACCUSATION = re.compile("description_wrong|description_doubted|diverged|inconsistent|contradict")
LONGEST = 60  # s, of a cut without an end


def kilvo(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True)


def doctor(program, recording, config, cut):
    """accusations, as text, and the number of checks by which something could be judged"""
    start, duration = cut
    command = ["doctor", recording, "--config", config, "--json", "--start", str(start), "--duration", str(duration)]
    done = kilvo(program, *command)
    if NO_VERDICT.search(done.stderr):
        return [], 0
    if done.returncode not in (0, 1, 3) or not done.stdout:
        return [f"exit {done.returncode}: {done.stderr.strip()[-200:]}"], 0
    result = json.loads(done.stdout)
    judged = sum(check["verdict"] in ("good", "note", "wrong") for check in result["checks"])
    return [f"{f['cause']}: {f['text']} [{f['evidence']}]" for f in result["findings"]], judged


def run(program, recording, config, cut, senses, folder):
    start, duration = cut
    command = ["run", recording, "--config", config, "--out", folder, "--no-map", "--quiet", "--start", str(start), "--duration", str(duration)]
    if senses:
        command += ["--sensors", senses]
    done = kilvo(program, *command)
    if NO_VERDICT.search(done.stderr):
        return []
    found = [f"exit {done.returncode}: {done.stderr.strip()[-200:]}"] if done.returncode else []
    try:
        summary = json.load(open(os.path.join(folder, "summary.json")))
    except (OSError, ValueError):
        return found
    found += [f"{e['reason']}: {e['text']}" for e in summary["events"] if ACCUSATION.search(e["reason"])]
    found += [f"warning: {w}" for w in summary["warnings"] if re.search("describ|left out|mended", w)]
    return found


class Table:
    def __init__(self, arguments, work):
        self.arguments, self.work = arguments, work
        self.count, self.accused = collections.Counter(), collections.Counter()
        self.judged = collections.Counter()

    def judge(self, group, name, recording, config, cut, senses):
        name = f"{name} {cut[0]:g}+{cut[1]:g}"
        found, judged = doctor(self.arguments.kilvo, recording, config, cut)
        found = [("doctor", x) for x in found]
        if self.arguments.run:
            found += [("run", x) for x in run(self.arguments.kilvo, recording, config, cut, senses, os.path.join(self.work, "run"))]
        self.count[group] += 1
        self.judged[group] += judged
        self.accused[group] += bool(found)
        for verb, text in found:
            print(f"ACCUSED {verb:6} {name:44} {text}", flush=True)

    def print(self):
        for group, n in self.count.items():
            print(f"{group:12} {n:5} judged, {self.judged[group] / n:5.1f} checks each, {self.accused[group]:4} accused")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kilvo")
    parser.add_argument("--scenarios", default=SCENARIOS)
    parser.add_argument("--seeds", default="1,2")
    parser.add_argument("--senses", default="ki", help="of ki, kil, li, liv, kilv; more than one with commas between")
    parser.add_argument("--cuts", default="0+5,0+8,0+15", help="START+DURATION, s; more than one with commas between")
    parser.add_argument("--wear", action="append", default=[], help="options of kilvo simulate")
    parser.add_argument("--recording", nargs=2, action="append", default=[], metavar=("BAG", "CONFIG"))
    parser.add_argument("--run", action="store_true")
    parser.add_argument("--only", default="", help="only those whose name holds this text (a regular expression)")
    a = parser.parse_args()
    cuts = [tuple(float(x) if x else LONGEST for x in (cut + "+").split("+")[:2]) for cut in a.cuts.split(",")]
    with tempfile.TemporaryDirectory(prefix="false-alarms-") as work:
        table = Table(a, work)
        for bag, config in a.recording:
            for cut in cuts:
                table.judge("recordings", os.path.basename(bag), bag, config, cut, None)
        folder = os.path.join(work, "walk")
        for wear in ["", *a.wear] if not a.recording else []:
            for scenario in a.scenarios.split(","):
                for seed in a.seeds.split(","):
                    for senses in a.senses.split(","):
                        name = f"{scenario} {seed} {senses} {wear}".strip()
                        if not re.search(a.only, name):
                            continue
                        sensors = ",".join(SENSES[c] for c in senses)
                        end = max(start + duration for start, duration in cuts)
                        made = kilvo(a.kilvo, "simulate", scenario, "--seed", seed, "--duration", str(end), "--sensors", sensors, "--out",
                                     folder, "--quiet", *wear.split())
                        if made.returncode:
                            sys.exit(made.stderr)
                        for cut in cuts:
                            table.judge(senses, name, folder, os.path.join(folder, "config.yaml"), cut, sensors)
        table.print()
        return 1 if any(table.accused.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
