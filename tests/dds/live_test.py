"""`kilvo live` as a robot meets it: another vendor's DDS plays a simulated walk, dies, comes back, and others disturb.

No assertion is on how fast the machine is, but for generous limits."""
import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ARGUMENTS = argparse.Namespace()
SECONDS = 6.0  # of the walk


class Program:
    """A child whose output is kept."""
    running: list = []

    def __init__(self, *command: str):
        self.running.append(self)
        self.log = tempfile.NamedTemporaryFile("w+", suffix=".log", delete=False)
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.log, text=True)

    def said(self) -> str:
        with open(self.log.name, encoding="utf-8", errors="replace") as file:
            return file.read()

    def end(self, how: int = signal.SIGINT) -> int:
        if self.process.poll() is None:
            self.process.send_signal(how)
        if self.process.stdout is not None and not self.process.stdout.closed:
            self.out, _ = self.process.communicate(timeout=60)
        return self.process.returncode


def wait_until(true, seconds: float = 30) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if true():
            return True
        time.sleep(0.05)
    return False


class Story:
    def __init__(self, folder: str):
        self.folder, self.domain = folder, str(random.SystemRandom().randrange(20, 200))
        self.walk = os.path.join(folder, "walk")
        run(ARGUMENTS.kilvo, "simulate", "room", "--seed", "3", "--duration", str(SECONDS), "--out", self.walk, "--quiet")
        self.bag, self.config = os.path.join(self.walk, "recording.bag"), os.path.join(self.walk, "no_camera.yaml")
        with open(os.path.join(self.walk, "config.yaml"), encoding="utf-8") as file:
            text = re.sub(r"^camera:\n(?:[ #].*\n|\n)*", "", file.read(), flags=re.M)
        with open(self.config, "w", encoding="utf-8") as file:
            file.write(text)

    def live(self, *more: str) -> Program:
        live = Program(ARGUMENTS.kilvo, "live", "--config", self.config, "--domain", self.domain, "--peer", "127.0.0.1", "--interface", "lo",
                       "--set", f"live.map_file={self.folder}/map.ply", *more)
        if not wait_until(lambda: "odometry of" in live.said()):
            raise AssertionError(live.said())
        return live

    def peer(self, *words: str) -> Program:
        return Program(ARGUMENTS.peer, *words)

    def play(self, *more: str) -> Program:
        return self.peer("play", self.bag, self.domain, *more)

    def listen(self, name: str, seconds: float) -> Program:
        return self.peer("listen", self.domain, os.path.join(self.folder, name), str(seconds))


def run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


STORY: Story


class LiveTest(unittest.TestCase):
    def tearDown(self):
        # What a test that failed leaves behind would send into the next one.
        for program in Program.running:
            program.end(signal.SIGKILL)
        Program.running.clear()

    def heard(self, listener: Program) -> dict:
        listener.process.wait(120)
        listener.end()
        return json.loads(listener.out)

    def error_of(self, name: str) -> float:
        """m: of the odometry against the truth; stamps are those of today, so the walk is found by its own shape."""
        return json.loads(run(sys.executable, os.path.join(os.path.dirname(__file__), "shifted_error.py"), os.path.join(STORY.folder, name),
                              os.path.join(STORY.walk, "gt.tum")))["rmse"]

    def test_a_walk_comes_in_and_the_results_go_out(self):
        live = STORY.live("--set", "live.base=imu")
        listener = STORY.listen("walk.tum", SECONDS + 3)
        time.sleep(0.5)
        player = STORY.play()
        player.process.wait(60)
        heard = self.heard(listener)
        self.assertEqual(live.end(), 0, live.said())
        self.assertGreater(heard["odometry"], 300, live.said())
        self.assertGreater(heard["smooth"], 300)
        self.assertGreater(heard["transforms"], 50)
        self.assertGreater(heard["clouds"], 10)
        self.assertGreater(heard["contacts"], 300)
        self.assertGreater(heard["diagnostics"], 3)
        self.assertGreater(heard["paths"], 1)
        self.assertLess(self.error_of("walk.tum"), 0.0015)
        self.assertIn("KILV", live.said().replace("KIL (", "KILV ("))

    def test_b_peers_die_come_back_and_disturb(self):
        live = STORY.live()
        disturbers = [STORY.peer(what, STORY.domain, "8") for what in ("garbage", "wrong-type", "picky")]
        player = STORY.play("--only", "imu,legs")
        self.assertTrue(wait_until(lambda: "KI (" in live.said()), live.said())
        player.end(signal.SIGKILL)
        self.assertTrue(wait_until(lambda: "lost: imu" in live.said()), live.said())
        again = STORY.play("--only", "imu,legs")
        listener = STORY.listen("again.tum", 4)
        self.assertGreater(self.heard(listener)["odometry"], 100, live.said())
        again.end(signal.SIGKILL)
        for disturber in disturbers:
            disturber.end()
        self.assertEqual(live.end(), 0, live.said())
        self.assertIn("/points: a publisher sends sensor_msgs/LaserScan, but the sensor lidar needs sensor_msgs/PointCloud2", live.said())
        self.assertIn("/kilvo/odometry: a subscriber asks for another durability", live.said())
        self.assertIn("deserialization rt/imu", live.said())
        self.assertLess(live.said().count("deserialization"), 10)

    def test_c_a_low_state_finds_its_time(self):
        live = STORY.live("--set", "legs.topic=rt/lowstate", "--set", "legs.clock=estimated", "--set", "legs.gyro_link=pelvis", "--set",
                          "legs.rate=500")
        listener = STORY.listen("low.tum", SECONDS + 3)
        time.sleep(0.5)
        STORY.play("--legs", "lowstate").process.wait(60)
        heard = self.heard(listener)
        self.assertEqual(live.end(), 0, live.said())
        self.assertGreater(heard["contacts"], 200, live.said())
        self.assertGreater(heard["odometry"], 300)
        self.assertNotIn("duplicate", live.said())  # messages that are taken at once

    def test_c2_a_low_state_that_is_none_is_named(self):
        live = STORY.live("--set", "legs.topic=rt/lowstate", "--set", "legs.clock=estimated", "--set", "legs.gyro_link=pelvis")
        for words, text in ((("--crc", "12345"), "rt/lowstate: unitree_hg/LowState: the checksum is wrong"),
                            (("--mode-pr", "1"), "mode_pr is 1: ankles and waist are angles of motors"),
                            (("--mode-machine", "9"), "mode_machine 9 is no robot")):
            STORY.play("--only", "legs", "--legs", "lowstate", "--seconds", "1", *words).process.wait(30)
            self.assertTrue(wait_until(lambda text=text: text in live.said()), live.said())
        dog = STORY.peer("wrong-type", STORY.domain, "2", "rt/lowstate", "unitree_go::msg::dds_::LowState_")
        self.assertTrue(wait_until(lambda: "(Go2, B2, H1): its legs are not read" in live.said()), live.said())
        dog.end()
        STORY.play("--only", "imu,legs", "--legs", "lowstate", "--seconds", "3").process.wait(30)
        self.assertIn("KI (", live.said())
        self.assertEqual(live.end(), 0, live.said())

    def test_e_images_services_and_the_record(self):
        record, map_file = os.path.join(STORY.folder, "record.mcap"), os.path.join(STORY.folder, "map.ply")
        live = Program(ARGUMENTS.kilvo, "live", "--config", os.path.join(STORY.walk, "config.yaml"), "--domain", STORY.domain, "--peer", "127.0.0.1",
                       "--interface", "lo", "--set", f"live.map_file={map_file}", "--record", record)
        self.assertTrue(wait_until(lambda: "odometry of" in live.said()), live.said())
        player = STORY.play("--only", "imu,legs,lidar,camera")
        self.assertTrue(wait_until(lambda: "KILV (" in live.said()), live.said())

        def ask(*words: str) -> dict:
            answer = json.loads(run(ARGUMENTS.peer, "call", STORY.domain, *words))
            self.assertTrue(answer["success"], answer)
            return answer

        self.assertIn(map_file, ask("kilvo/save_map")["message"])
        self.assertGreater(os.path.getsize(map_file), 10000)
        ask("kilvo/pause/lidar", "1")
        self.assertTrue(wait_until(lambda: "lidar is left out" in live.said()), live.said())
        ask("kilvo/pause/lidar", "0")
        ask("kilvo/reset")
        self.assertTrue(wait_until(lambda: "kilvo: reset" in live.said()), live.said())
        player.process.wait(60)
        self.assertEqual(live.end(), 0, live.said())
        info = run(ARGUMENTS.kilvo, "info", record)
        for topic in ("/kilvo/odometry", "/kilvo/cloud", "/kilvo/cloud_coloured", "/kilvo/contacts", "/tf", "/diagnostics"):
            self.assertRegex(info, topic + " .*_?msgs/")

    def test_f_a_recording_that_is_played_again_begins_anew(self):
        live = STORY.live("--set", "live.base=imu")
        listener = STORY.listen("twice.tum", 2 * SECONDS + 8)
        time.sleep(0.5)
        for _ in range(2):
            STORY.play("--stamps", "recorded").process.wait(60)
        self.assertTrue(wait_until(lambda: "epoch 2" in live.said()), live.said())
        self.heard(listener)
        self.assertEqual(live.end(), 0, live.said())
        self.assertIn("the time went back by", live.said())
        self.assertNotIn("diverged", live.said())
        with open(os.path.join(STORY.folder, "twice.tum"), encoding="utf-8") as file:
            lines = file.readlines()
        t = [float(line.split()[0]) for line in lines]
        back = [i for i in range(1, len(t)) if t[i] < t[i - 1]]
        self.assertEqual(len(back), 1, "once, to the recording's own stamps")
        self.assertLess(max(abs(float(x)) for x in lines[back[0]].split()[1:4]), 0.05, "from the start")
        for name, part in (("first.tum", lines[:back[0]]), ("second.tum", lines[back[0]:])):
            with open(os.path.join(STORY.folder, name), "w", encoding="utf-8") as file:
                file.writelines(part)
            self.assertGreater(len(part), 300)
            self.assertLess(self.error_of(name), 0.02, name)

    def test_d_a_topic_on_which_nothing_comes_is_named(self):
        live = STORY.live("--set", "lidar.topic=/pionts")
        self.assertTrue(wait_until(lambda: "lost: imu (no message on /imu yet), legs (no message on /joint_states yet)" in live.said()), live.said())
        STORY.play("--seconds", "3").process.wait(30)
        self.assertEqual(live.end(), 0, live.said())
        self.assertIn("KI (", live.said())
        self.assertIn("lidar (no message on /pionts yet)", live.said())

    def test_d_without_a_network_it_says_so(self):
        alone = ("unshare", "--net", "--map-root-user")
        if subprocess.run([*alone, "true"], capture_output=True, check=False).returncode != 0:
            self.skipTest("no namespaces here")
        program = Program(*alone, ARGUMENTS.kilvo, "live", "--config", STORY.config, "--domain", STORY.domain)
        program.process.wait(30)
        self.assertEqual(program.end(), 2, program.said())
        self.assertIn("failed to find interfaces", program.said())

    def test_d_what_cannot_be_is_refused(self):
        for words, text in ((("--interface", "no_such_interface"), "cannot be entered"), (("--set", "live.base=tail"), "nearest is")):
            program = Program(ARGUMENTS.kilvo, "live", "--config", STORY.config, "--domain", STORY.domain, *words)
            program.process.wait(30)
            self.assertEqual(program.end(), 2, program.said())
            self.assertIn(text, program.said())


def main() -> int:
    global STORY
    parser = argparse.ArgumentParser()
    parser.add_argument("--kilvo", required=True)
    parser.add_argument("--peer", required=True)
    rest = parser.parse_known_args(namespace=ARGUMENTS)[1]
    with tempfile.TemporaryDirectory() as folder:
        STORY = Story(folder)
        return 0 if unittest.main(argv=[sys.argv[0], *rest], exit=False).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
