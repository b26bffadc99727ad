"""bench/paper/run on a short simulated walk: each table and figure is there, and what is not a time is the same again, to the byte."""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
COMMAND = os.path.join(ROOT, "bench", "paper", "run")
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "bench", "paper"))
import figures  # noqa: E402
import tables  # noqa: E402
import trials  # noqa: E402

kilvo = None


class Pieces(unittest.TestCase):
    def test_drift_is_told_from_a_way_that_is_off(self):
        # Half a metre ahead of ten, and 0.2 m too high; seen from a body that is turned by a right angle.
        truth = [[0.1 * i, 0, 0.1 * i, 0, 0, 0, 2 ** -0.5, 2 ** -0.5] for i in range(101)]
        estimate = [[0.1 * i, 0.105 * i, 0, 0.002 * i, 0, 0, 0, 1] for i in range(101)]
        found = trials.drift(estimate, truth, 0)
        self.assertAlmostEqual(found["way"], 10, places=6)
        self.assertAlmostEqual(found["xy"], 5, places=6)
        self.assertAlmostEqual(found["z"], 2, places=6)
        self.assertIsNone(trials.drift(estimate, truth, 9.9))

    def test_comparisons_are_geometric_means_of_ratios(self):
        def of(base, other):
            return {"ablations": {"as it is": {"KIL": base}, "worse": {"KIL": other}}}

        results = {"a": of(1.0, 2.0), "b": of(4.0, 2.0), "c": of(1.0, 8.0)}
        first, each = tables.comparison("Ablations", results, "ablations", [("as it is", [], ["KIL"]), ("worse", ["x=1"], ["KIL"])], "")
        self.assertEqual(first.rows[0][2], "1.59")
        self.assertEqual(first.rows[1][2], "3.17 (x 2.00)")
        self.assertEqual(len(each.rows), 6)

    def test_failures_are_compared_with_the_undisturbed_run(self):
        def of(undisturbed, recovered, drift=None):
            return {"failures": {"undisturbed": undisturbed, "recovered": recovered, "unrecoverable": 9.0} | ({"drift": drift} if drift else {})}

        results = {"a": of(1.0, 3.5, {"xy": 0.2, "z": 0.4, "way": 5}), "b": of(4.0, 3.96, {"xy": 0.3, "z": 0.1, "way": 2}), "c": of(2.0, 2.0)}
        rows = tables.failures(results)[0].rows
        self.assertEqual(rows[0], ["a", "1.0", "3.5", "+2.5", "9.0", "0.20 / 0.40 of 5.0 m"])
        self.assertEqual([row[3] for row in rows], ["+2.5", "+0.0", "+0.0", "+2.5"])
        self.assertEqual(rows[-1][-1], "0.30 / 0.40")

    def test_what_is_not_known_is_no_zero(self):
        found = {"ate_rmse_m": 0.001, "e2e_m": 0.001, "e2e_z_m": -0.001, "rte_1m_percent": None, "diverged": False}
        rte = tables.accuracy({"a": {"accuracy": {"KI": {"se3": found, "yaw": found}}}})[2]
        self.assertEqual(rte.rows, [["a", "-"], ["mean", "-"]])

    def test_ticks_are_round_and_inside(self):
        self.assertEqual(figures.ticks(0, 10), [0, 2, 4, 6, 8, 10])
        for low, high in ((-0.013, 0.021), (3, 3.001), (-900, 12000)):
            found = figures.ticks(low, high)
            self.assertGreaterEqual(len(found), 3)
            self.assertTrue(all(low - 1e-9 <= t <= high + 1e-9 for t in found))


class PaperRun(unittest.TestCase):
    def setUp(self):
        if kilvo is None:
            self.skipTest("no program")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, *names: str) -> str:
        return os.path.join(self.folder, *names)

    def read(self, *names: str) -> str:
        with open(self.path(*names), encoding="utf-8") as file:
            return file.read()

    def run_it(self, *words: str, code: int = 0) -> str:
        done = subprocess.run([sys.executable, COMMAND, "--kilvo", kilvo, *words], capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def test_a_walk_of_five_seconds_gives_every_table_and_figure(self):
        told = self.run_it("--out", self.path("first"), "--walks", "room_short", "--duration", "5", "--keep")
        for part in ("simulating", "contacts", "accuracy", "failures", "degradation", "ablations"):
            self.assertIn(f"room_short: {part}", told)
        text, page = self.read("first", "results.md"), self.read("first", "results.html")
        for title in ("Table I:", "Table II:", "Table III:", "Table IV:", "Table V:", "Failures", "Degradation from", "Ablations", "(KI)", "(KI) from the start",
                      "What this page cost"):
            self.assertIn(title, text)
            self.assertIn(title, page)
        accuracy = text[text.index("Table III"):]
        row = re.search(r"\| room_short \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|", accuracy)
        self.assertIsNotNone(row, accuracy[:600])
        self.assertTrue(all(0.01 < float(cell) < 30 for cell in row.groups()), row.groups())
        named = re.findall(r"\]\((figures/\S+\.svg)\)", text)
        self.assertEqual(page.count("<svg "), len(named))
        self.assertGreaterEqual(len(named), 10)
        for name in named:
            self.assertTrue(self.read("first", name).startswith("<svg "), name)
        found = json.loads(self.read("first", "results.json"))["room_short"]
        self.assertEqual(set(found["accuracy"]) - {"drift"}, {"LI", "LIV", "KIL", "KILV", "KI"})
        self.assertIn("KI", dict((name, t) for t, name in found["failures"]["modalities"]["unrecoverable"]))
        self.assertIn("LIV", [name for _, name in found["failures"]["modalities"]["recovered"]])
        # Legs and IMU alone, on walks of their own: three, each of three seeds and two robots.
        legs = json.loads(self.read("first", "results.json"))["legs"]
        self.assertEqual(len({(r["walk"], r["seed"], r["level"]) for r in legs}), 18)
        self.assertTrue(all(r["way"] > 0.3 and r["xy"] < 5 and r["z"] < 10 for r in legs), legs)
        # The same folder, twice; a part of the tables.
        for out in ("second", "third"):
            self.run_it("--out", self.path(out), "--only", "accuracy", "--only", "times", "--only", "paths", "--no-times", self.path("first", "walks"))
        for name in sorted(os.listdir(self.path("second"))):
            if os.path.isfile(self.path("second", name)):
                self.assertEqual(self.read("second", name), self.read("third", name), name)
        self.assertIn(row.group(0), self.read("second", "results.md"))
        self.assertNotIn("Table V", self.read("second", "results.md"))

    def test_a_description_that_is_wrong_is_told_and_all_sensors_are_judged(self):
        subprocess.run([kilvo, "simulate", "room", "--out", self.path("walks", "room"), "--duration", "12", "--sensors", "imu,legs,lidar", "--quiet"], check=True)
        described = self.read("walks", "room", "config.yaml")
        with open(self.path("walks", "room", "config.yaml"), "w", encoding="utf-8") as file:
            file.write(described[:described.index("\ncamera:")])
        # The LiDAR turned by 20 degrees.
        wrong = "lidar.T_imu_lidar.R=[0.9396926208, 0, 0.3420201433, 0, 1, 0, -0.3420201433, 0, 0.9396926208]"
        self.run_it("--out", self.path("out"), "--only", "accuracy", "--set", wrong, self.path("walks"))
        text = self.read("out", "results.md")
        self.assertIn("room, ended as failed by kilvo but judged here all the same: KIL: the robot's description is wrong: the LiDAR", text)
        self.assertRegex(text, r"\| room \| [\d.]+( x)? \| [\d.]+( x)? \| [\d.]+ \|")

    def test_a_walk_is_cut_but_never_drawn_out(self):
        self.assertEqual(trials.cut_to(kilvo, "spin", 60, self.folder), [])
        self.assertEqual(trials.cut_to(kilvo, "robust", 60, self.folder), ["--duration", "60"])
        self.assertEqual(trials.cut_to(kilvo, "robust", None, self.folder), [])
        self.assertEqual(os.listdir(self.folder), [])

    def test_lengths_that_contradict_each_other_are_refused(self):
        told = self.run_it("--out", self.path("out"), "--full", "--duration", "5", code=2)
        self.assertIn("--full", told)

    def test_a_recording_that_fails_is_named(self):
        told = self.run_it("--out", self.path("out"), "--walks", "moon", "--only", "accuracy", code=1)
        self.assertIn("moon", told)
        self.assertIn("no scenario", told)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--kilvo")
    options, rest = parser.parse_known_args()
    kilvo = options.kilvo
    unittest.main(argv=[sys.argv[0], *rest])
