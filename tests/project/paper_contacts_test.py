"""bench/paper/contacts with a program that stands in for kilvo: which recordings it takes, and what it makes of the answers."""
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PROGRAM = os.path.join(ROOT, "bench", "paper", "contacts")

# Accuracy by way; `force` finds no event, as without efforts.
STAND_IN = """#!/usr/bin/env python3
import json, os, sys
words = sys.argv[1:]
if words[0] == "run" and "broken" in words[1]:
    sys.exit("cannot be read")
if words[0] == "run":
    out = words[words.index("--out") + 1]
    way = next(w.split("=")[1] for w in words if w.startswith("legs.contact="))
    with open(os.environ["CALLS"], "a") as log:
        log.write(" ".join([os.path.basename(words[1]), way, words[words.index("--sensors") + 1], words[words.index("--config") + 1]]) + "\\n")
    os.makedirs(out, exist_ok=True)
    open(os.path.join(out, "contacts.csv"), "w").write(way)
    open(os.path.join(out, "odometry.tum"), "w").write("")
    open(os.path.join(out, "timing.csv"), "w").write("t,stage,microseconds\\n0,contact,2.0\\n1,kinematic,9.0\\n2,contact,4.0\\n")
    json.dump({"lost_stances": 3 if way == "paper" else 0}, open(os.path.join(out, "summary.json"), "w"))
elif words[0] == "eval":
    print(json.dumps({"path_length_m": 10, "e2e_m": 0.05, "e2e_z_m": -0.03, "ate_rmse_m": 0.02}))
else:
    way = open(words[1]).read()
    events = 0 if way == "force" else 5
    foot = {"correct": events, "true_events": 6, "estimated_events": events, "touchdown_errors_ms": {"all": [1.0, 3.0, 5.0]}, "liftoff_errors_ms": {"all": []}}
    print(json.dumps({"accuracy": {"variance": 0.8, "paper": 0.9, "kilvo": 0.97}.get(way, 0.5), "false_positive_rate": 0.02, "left": foot, "right": foot}))
"""


class PaperContacts(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.write("kilvo", STAND_IN)
        os.chmod(self.path("kilvo"), 0o755)
        os.mkdir(self.path("rec"))

    def path(self, name: str) -> str:
        return os.path.join(self.folder.name, name)

    def write(self, name: str, text: str = "") -> None:
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def run_it(self, *words: str) -> subprocess.CompletedProcess:
        return subprocess.run([sys.executable, PROGRAM, "--kilvo", self.path("kilvo"), self.path("rec"), *words], capture_output=True, text=True,
                              env=os.environ | {"CALLS": self.path("calls")})

    def calls(self) -> list[list[str]]:
        with open(self.path("calls"), encoding="utf-8") as file:
            return [line.split() for line in file]

    def test_tables_of_a_recording_and_of_a_simulated_folder(self):
        for ending in (".bag", ".contact.csv", ".gt.tum"):
            self.write("rec/icub_walk" + ending)
        for name in ("recording.bag", "contacts.gt.csv", "gt.tum"):
            self.write("rec/room_1/" + name)
        self.write("rec/room_1/config.yaml", "imu:\nlidar:\n")
        self.write("rec/no_truth.bag")
        done = self.run_it()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("no_truth: skipped", done.stderr)
        # No efforts: no force. Events, accuracy, false positives, errors, times, drift.
        self.assertIn("| icub_walk | - | 5/5 | 5/5 | 5/5 | 6/6 |", done.stdout)
        self.assertIn("| room_1 | - | 80.0 | 90.0 | 97.0 |", done.stdout)
        self.assertIn("| mean | - | 80.0 | 90.0 | 97.0 |", done.stdout)
        self.assertIn("| icub_walk | - | 2.0 | 2.0 | 2.0 |", done.stdout)
        self.assertIn("+3 (+1 .. +5)", done.stdout)
        self.assertIn("4.0 / 4.0", done.stdout)
        self.assertIn("0.40 / 0.30; 20; 3", done.stdout)
        calls = self.calls()
        self.assertEqual(len(calls), 4 + 8)  # the legs alone; beside the LiDAR where there is one
        self.assertTrue(all(c[3].endswith("icub.yaml") and c[2] == "legs,imu" for c in calls if c[0] == "icub_walk.bag"))
        self.assertEqual({c[2] for c in calls if c[0] == "recording.bag"}, {"legs,imu", "legs,imu,lidar"})

    def test_a_recording_that_fails_is_named_and_the_others_are_kept(self):
        for name in ("icub_walk", "icub_broken"):
            for ending in (".bag", ".contact.csv", ".gt.tum"):
                self.write("rec/" + name + ending)
        done = self.run_it()
        self.assertEqual(done.returncode, 1)
        self.assertIn("| icub_walk | - | 80.0 | 90.0 | 97.0 |", done.stdout)
        self.assertNotIn("| icub_broken", done.stdout)
        self.assertIn("icub_broken, paper:", done.stderr)
        self.assertIn("cannot be read", done.stderr)

    def test_what_is_missing_is_named(self):
        done = self.run_it()
        self.assertEqual(done.returncode, 1)
        self.assertIn("no recording in", done.stderr)
        self.write("rec/a.bag")
        done = self.run_it("b")
        self.assertEqual(done.returncode, 1)
        self.assertIn("has no recording b", done.stderr)


if __name__ == "__main__":
    unittest.main()
