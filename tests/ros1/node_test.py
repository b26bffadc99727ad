"""kilvo_node as a robot meets it: started before there is a master, topics that come, die and come back, services, a master that dies.

One story is played once; each test looks at another side of it."""
import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

import ros_world
from ros_world import Process, wait_until

ARGUMENTS = argparse.Namespace()
SECONDS = 8.0  # of the walk
TWICE = 6.0    # of what is played again
HALF = 5.0     # where the player dies and another one goes on


class Ears:
    """Keeps what the node says."""

    def __init__(self):
        import rospy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseArray
        from nav_msgs.msg import Odometry, Path
        from sensor_msgs.msg import JointState, PointCloud2
        from tf2_msgs.msg import TFMessage
        rospy.init_node("ears", disable_signals=True)
        self.best, self.smooth, self.contacts, self.clouds, self.coloured, self.paths = [], [], [], [], [], []
        self.transforms, self.diagnostics, self.ground = [], [], []
        self.subscribers = [
            rospy.Subscriber(topic, kind, kept.append, queue_size=20000, tcp_nodelay=True)
            for topic, kind, kept in (("/kilvo/odometry", Odometry, self.best), ("/kilvo/odometry_smooth", Odometry, self.smooth),
                                      ("/kilvo/contacts", JointState, self.contacts), ("/kilvo/cloud", PointCloud2, self.clouds),
                                      ("/kilvo/cloud_coloured", PointCloud2, self.coloured), ("/kilvo/path", Path, self.paths), ("/kilvo/ground", PoseArray, self.ground),
                                      ("/tf", TFMessage, self.transforms))]
        # With the time of arrival, and each status by its name.
        self.subscribers.append(rospy.Subscriber("/diagnostics", DiagnosticArray, lambda m: self.diagnostics.append(
            (time.monotonic(), {s.name.removeprefix("kilvo: "): s for s in m.status}))))

    def newest_status(self, name: str):
        return self.diagnostics[-1][1].get(name) if self.diagnostics else None

    def first_status_since(self, begin: float, name: str, text: str):
        """Seconds until a status had `text` in its message; None while it has not."""
        return next((t - begin for t, all_of in list(self.diagnostics) if t >= begin and text in all_of[name].message), None)


def call(name: str, **request):
    import rospy
    from std_srvs.srv import SetBool, Trigger
    rospy.wait_for_service(name, 20)
    return rospy.ServiceProxy(name, SetBool if request else Trigger)(**request)


def stamps(messages) -> np.ndarray:
    return np.array([m.header.stamp.secs * 10**9 + m.header.stamp.nsecs for m in messages], dtype=np.int64)


def poses(messages) -> tuple[np.ndarray, np.ndarray]:
    """Positions and rotation matrices."""
    p = np.array([[m.pose.pose.position.x, m.pose.pose.position.y, m.pose.pose.position.z] for m in messages])
    q = np.array([[m.pose.pose.orientation.x, m.pose.pose.orientation.y, m.pose.pose.orientation.z, m.pose.pose.orientation.w] for m in messages])
    return p, rotations(q)


def rotations(q: np.ndarray) -> np.ndarray:
    x, y, z, w = q.T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


class Story:
    """What happened; the tests only look."""

    def __init__(self, folder: str):
        self.folder = folder
        self.port = ros_world.settle(folder)
        self.config = os.path.join(folder, "walk/config.yaml")
        self.bag = os.path.join(folder, "walk/recording.bag")
        self.map_file = os.path.join(folder, "map.ply")
        subprocess.run([ARGUMENTS.kilvo, "simulate", "room", "--seed", "3", "--duration", str(SECONDS), "--out", os.path.dirname(self.bag), "--quiet"],
                       check=True, capture_output=True)
        self.node = self.start_node()
        self.waited_for_master = wait_until(lambda: self.node.said("waiting for a ROS master"))
        self.master = ros_world.Master(self.port)
        try:
            self.listens = wait_until(lambda: self.master.subscribed("/joint_states"))
            self.ears = Ears()
            self.walk()
            self.other_types = {package: self.play_as(package, self.config) for package in ("livox_ros_driver", "livox_ros_driver2")}
            feet_config = ros_world.with_two_feet(self.config, os.path.join(os.path.dirname(self.bag), "feet.yaml"))
            body = ros_world.Body(os.path.join(os.path.dirname(self.bag), "robot.urdf"))
            self.two_feet = self.play_as("livox_ros_driver2", feet_config, body)
            self.twice = {name: self.play_twice(name == "by the recording's clock") for name in ("by the wall", "by the recording's clock")}
            self.start_anew(self.config)
            self.pause_and_reset()
            self.without_master()
        finally:
            for process in (self.node, self.master):
                if process.running():
                    process.end(signal.SIGKILL)

    def start_node(self, *parameters: str) -> Process:
        # The truth is that of the IMU.
        return Process(ARGUMENTS.node, "_base:=imu", *(parameters or (f"_config:={self.config}", f"_map_file:={self.map_file}")))

    def start_anew(self, config: str) -> None:
        self.node.end()
        self.node = self.start_node(f"_config:={config}", f"_map_file:={self.map_file}")
        wait_until(lambda: self.master.subscribed("/joint_states"))
        self.ears.diagnostics.clear()

    def play(self, start: float = 0, seconds: float | None = None) -> Process:
        return ros_world.player(self.bag, ARGUMENTS.speed, start, seconds)

    # Topics come after the node, die in the middle and come back.
    def walk(self) -> None:
        self.play(0, HALF).wait()
        self.died = time.monotonic()
        wait_until(lambda: self.ears.first_status_since(self.died - 1, "imu", "lost: no message on /imu"), 10)
        self.imu_lost_after = self.ears.first_status_since(self.died - 1, "imu", "lost: no message on /imu")
        self.play(HALF).wait()
        wait_until(lambda: len(self.ears.best) > 0 and self.heard_all())
        self.best, self.smooth = list(self.ears.best), list(self.ears.smooth)
        self.contacts, self.clouds, self.coloured = list(self.ears.contacts), list(self.ears.clouds), list(self.ears.coloured)
        self.ground = list(self.ears.ground)
        wait_until(lambda: self.levelled_at() is not None, 3)
        self.level_since = self.levelled_at()
        self.saved = call("/kilvo/save_map")

    def levelled_at(self) -> float | None:
        """When the world was levelled, s, as the diagnostics report it."""
        status = self.ears.newest_status("estimator")
        notes = [v.value for v in status.values if v.key == "notice" and v.value.startswith("levelled: ")]
        return float(notes[0].split()[1]) if notes else None

    def heard_all(self) -> bool:
        count = len(self.ears.best)
        time.sleep(0.5)
        return len(self.ears.best) == count

    def pause_and_reset(self) -> None:
        self.reset_answer = call("/kilvo/reset")
        self.poses_before_reset = len(self.ears.best)
        second = self.play()
        wait_until(lambda: len(self.ears.best) > self.poses_before_reset + 1000 and "KILV" in self.ears.newest_status("estimator").message)
        paused = time.monotonic()
        self.pause_answer = call("/kilvo/pause/lidar", data=True)
        wait_until(lambda: self.ears.first_status_since(paused, "lidar", "paused"), 10)
        wait_until(lambda: self.ears.first_status_since(paused, "estimator", "KI ("), 10)
        self.pause_said_after = self.ears.first_status_since(paused, "lidar", "paused")
        self.legs_carry_after = self.ears.first_status_since(paused, "estimator", "KI (")
        self.estimator_names = self.ears.newest_status("estimator").message
        second.end(signal.SIGKILL)

    # A node begun anew, since each learns once how its LiDAR writes times.
    def play_as(self, package: str, config: str, body=None) -> dict:
        bag = os.path.join(self.folder, f"{package}.bag")
        ros_world.to_other_types(self.bag, bag, 4.0, package, body)
        self.start_anew(config)
        player = ros_world.player(bag, ARGUMENTS.speed)
        wait_until(lambda: self.ears.newest_status("estimator") and "KILV" in self.ears.newest_status("estimator").message, 15 / ARGUMENTS.speed)
        player.wait()
        return {name: self.ears.newest_status(name) for name in ("estimator", "legs", "lidar", "camera")}

    # The same recording again into a node that goes on; with use_sim_time as well.
    def play_twice(self, sim_time: bool) -> dict:
        self.master.proxy.setParam("/test", "/use_sim_time", sim_time)
        self.start_anew(self.config)
        first, transforms = len(self.ears.best), len(self.ears.transforms)
        for _ in range(2):
            ros_world.player(self.bag, ARGUMENTS.speed, 0, TWICE, sim_time).wait()
            wait_until(self.heard_all)
        wait_until(lambda: "epoch 2" in self.ears.newest_status("estimator").message, 5)
        self.master.proxy.setParam("/test", "/use_sim_time", False)
        return {"best": self.ears.best[first:], "transforms": self.ears.transforms[transforms:], "path": self.ears.paths[-1],
                "status": self.ears.newest_status("estimator")}

    def without_master(self) -> None:
        call("/kilvo/reset")
        count = len(self.ears.best)
        second = self.play()
        wait_until(lambda: len(self.ears.best) > count + 100)
        self.master.end(signal.SIGKILL)
        count = len(self.ears.best)
        self.goes_on = wait_until(lambda: len(self.ears.best) > count + 100, 10)
        time.sleep(1.0)
        self.alive_without_master = self.node.running()
        second.end(signal.SIGKILL)
        self.master = ros_world.Master(self.port)
        self.found_again = wait_until(lambda: self.master.subscribed("/joint_states") and "/kilvo/odometry" in self.master.published())
        call("/kilvo/reset")
        call("/kilvo/pause/lidar", data=False)
        count = len(self.ears.best)
        third = self.play(0, 3)
        self.fed_again = wait_until(lambda: len(self.ears.best) > count + 500)
        third.wait()
        self.master.end(signal.SIGKILL)
        self.exit_code, self.ended_after = self.node.end()


class Node(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.story = Story(cls.folder.name)
        with open(os.path.join(cls.folder.name, "walk/gt.tum"), encoding="utf-8") as file:
            rows = [line.split() for line in file if not line.startswith("#")]
        cls.truth_t = np.array([int(row[0].replace(".", "")) for row in rows], dtype=np.int64)  # nine decimals
        numbers = np.array([row[1:8] for row in rows], dtype=float)
        cls.truth_p, cls.truth_R = numbers[:, :3], rotations(numbers[:, 3:])

    def test_waits_for_a_master_and_for_topics(self):
        self.assertTrue(self.story.waited_for_master)
        self.assertTrue(self.story.listens)

    def test_answers_every_encoder_sample_after_the_start(self):
        import rosbag
        t = stamps(self.story.best)
        self.assertTrue(np.all(np.diff(t) > 0), "in time order, each once")
        with rosbag.Bag(self.story.bag) as bag:
            first = bag.get_start_time()
            samples = np.array([m.header.stamp.to_nsec() for _, m, _ in bag.read_messages(topics=["/joint_states"])])
        self.assertLess(t[0] * 1e-9 - first, 1.6, "it stands half a second, and the point times are looked at")
        due = samples[samples >= t[0]]
        share = np.isin(due, t).mean()
        seconds = (t[-1] - t[0]) * 1e-9
        print(f"odometry: {len(t)} in {seconds:.3f} s of data, {len(t) / seconds:.1f} Hz, {100 * share:.2f} % of the encoder samples answered")
        # A machine that is busy with other things gives samples up, as it must.
        missing = (due[~np.isin(due, t)] - samples[0]) * 1e-9
        self.assertGreater(share, 0.95, f"not answered, s: {missing[:50]}")
        np.testing.assert_array_equal(t, stamps(self.story.smooth))

    def test_covariances_are_symmetric_and_positive_definite(self):
        for messages in (self.story.best, self.story.smooth):
            for m in messages[::50] + messages[-1:]:
                for covariance in (m.pose.covariance, m.twist.covariance):
                    C = np.array(covariance).reshape(6, 6)
                    np.testing.assert_array_equal(C, C.T)
                    self.assertGreater(np.linalg.eigvalsh(C).min(), 0)
                    self.assertLess(np.sqrt(np.diag(C)).max(), 1)

    def test_the_twist_is_the_differentiated_pose_in_the_body(self):
        for name, messages in (("best", self.story.best), ("smooth", self.story.smooth)):
            t, (p, R) = stamps(messages), poses(messages)
            v = np.array([[m.twist.twist.linear.x, m.twist.twist.linear.y, m.twist.twist.linear.z] for m in messages])
            w = np.array([[m.twist.twist.angular.x, m.twist.twist.angular.y, m.twist.twist.angular.z] for m in messages])
            k = 20
            dt = (t[k:] - t[:-k]) * 1e-9
            straight = dt < 1.5e-3 * k  # not over a gap
            v_W = np.einsum("nij,nj->ni", R, v)
            mean_v = np.cumsum(np.vstack([np.zeros(3), v_W]), axis=0)
            mean_v = (mean_v[k:-1] - mean_v[:-k - 1]) / k
            moved = np.linalg.norm((p[k:] - p[:-k]) / dt[:, None] - mean_v, axis=1)[straight]
            turn = np.einsum("nji,njk->nik", R[:-k], R[k:])
            rate = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=1) / 2 / dt[:, None]
            mean_w = np.cumsum(np.vstack([np.zeros(3), w]), axis=0)
            turned = np.linalg.norm(rate - (mean_w[k:-1] - mean_w[:-k - 1]) / k, axis=1)[straight]
            print(f"{name}: twist against differences over 20 ms, median {np.median(moved):.4f} m/s, {np.median(turned):.4f} rad/s; "
                  f"mean speed {np.linalg.norm(v, axis=1).mean():.3f} m/s")
            self.assertLess(np.median(moved), 0.02)
            self.assertLess(np.median(turned), 0.05)
            self.assertGreater(np.abs(np.median(np.linalg.norm(v, axis=1))), 0.05, "it walks")

    def test_ends_within_two_millimetres_of_the_truth(self):
        for messages in (self.story.best, self.story.smooth):
            t, (p, R) = stamps(messages), poses(messages)
            i, j = 0, len(t) - 1
            a, b = (int(np.argmin(np.abs(self.truth_t - t[n]))) for n in (i, j))
            estimated = R[i].T @ (p[j] - p[i])
            true = self.truth_R[a].T @ (self.truth_p[b] - self.truth_p[a])
            error = np.linalg.norm(estimated - true)
            print(f"end-to-end error {1000 * error:.1f} mm over {np.linalg.norm(true):.2f} m")
            self.assertGreater(np.linalg.norm(true), 0.5)
            self.assertLess(error, 0.002)

    def test_the_smooth_odometry_makes_no_step(self):
        t, (p, _) = stamps(self.story.smooth), poses(self.story.smooth)
        next_to = np.diff(t) < 2_000_000
        self.assertLess(np.linalg.norm(np.diff(p, axis=0), axis=1)[next_to].max(), 0.005)

    def test_frames_hang_together(self):
        self.assertEqual({(m.header.frame_id, m.child_frame_id) for m in self.story.best}, {("map", "base_link")})
        self.assertEqual({(m.header.frame_id, m.child_frame_id) for m in self.story.smooth}, {("odom", "base_link")})
        edges = {(t.header.frame_id, t.child_frame_id) for m in self.story.ears.transforms for t in m.transforms}
        self.assertEqual(edges, {("map", "odom"), ("odom", "base_link")})

    def test_sweeps_colours_contacts_and_the_way_go_out(self):
        self.assertGreater(len(self.story.clouds), 8 * (SECONDS - 3))
        self.assertGreater(np.median([m.width for m in self.story.clouds]), 1000)
        self.assertEqual([f.name for f in self.story.clouds[-1].fields], ["x", "y", "z", "intensity"])
        self.assertEqual([f.name for f in self.story.coloured[-1].fields], ["x", "y", "z", "rgb"])
        self.assertEqual(self.story.contacts[-1].name, ["left", "right"])
        stands = np.array([m.effort for m in self.story.contacts])
        self.assertEqual(set(stands.ravel()), {0.0, 1.0})
        self.assertGreater(max(max(m.position) for m in self.story.contacts), 0.01, "a swinging foot is off the ground")
        self.assertGreater(max(len(m.poses) for m in self.story.ears.paths), 10)

    def test_the_ground_is_where_the_feet_are(self):
        ground = self.story.ground
        self.assertGreater(len(ground), 50 * (SECONDS - 3))
        # Gravity becomes known with turns, of which there are few. Some of the states of the thread that runs ahead were on their way.
        level_since = self.story.level_since
        if level_since is not None:
            ground = [m for m in ground if m.header.stamp.to_sec() > level_since + 0.1]
        self.assertGreater(len(ground), 50)
        self.assertEqual({m.header.frame_id for m in ground}, {"map"})
        self.assertEqual({len(m.poses) for m in ground}, {2})
        p = np.array([[[pose.position.x, pose.position.y, pose.position.z] for pose in m.poses] for m in ground])
        q = np.array([[pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w] for m in ground for pose in m.poses])
        self.assertGreater(rotations(q)[:, 2, 2].min(), np.cos(np.radians(5)), "the floor of the room is level")
        # One plane, as level as gravity is known: to a milliradian, or as the accelerometer measures it.
        places = p.reshape(-1, 3) - p.mean(axis=(0, 1))
        normal = np.linalg.svd(places, full_matrices=False)[2][2]
        off = np.abs(places @ normal)
        print(f"ground: {1000 * np.median(off):.1f} mm beside one plane (median), {1000 * off.max():.1f} at the most")
        self.assertLess(off.max(), 0.005)
        self.assertGreater(abs(normal[2]), np.cos(0.02 if level_since is None else 0.01))
        self.assertGreater(np.linalg.norm(p[:, 0] - p[:, 1], axis=1).min(), 0.1, "the feet stand side by side")

    def test_listens_to_livox_and_to_compressed_images(self):
        for package, end in self.story.other_types.items():
            print(f"{package}: {end['estimator'].message}")
            self.assertIn("KILV", end["estimator"].message)

    def test_listens_to_two_feet(self):
        end = self.story.two_feet
        used = {name: int(next(v.value for v in end[name].values if v.key == "used")) for name in ("legs", "lidar", "camera")}
        print(f"two feet: {end['estimator'].message}, used: {used}")
        self.assertIn("KILV", end["estimator"].message)
        self.assertGreater(used["legs"], 2000)

    def test_the_map_is_saved(self):
        self.assertTrue(self.story.saved.success, self.story.saved.message)
        with open(self.story.map_file, "rb") as file:
            self.assertTrue(file.read(1000).startswith(b"ply"))

    def test_diagnostics_name_a_sensor_that_falls_silent(self):
        self.assertIsNotNone(self.story.imu_lost_after)

    def test_a_paused_sensor_is_named_and_left_out(self):
        self.assertTrue(self.story.pause_answer.success)
        self.assertIsNotNone(self.story.pause_said_after)
        self.assertIsNotNone(self.story.legs_carry_after)
        print(f"paused lidar: named after {self.story.pause_said_after:.2f} s, modality KI told after {self.story.legs_carry_after:.2f} s: "
              f"{self.story.estimator_names}")
        self.assertLess(self.story.pause_said_after, 3)
        self.assertIn("lidar", self.story.estimator_names)

    def test_reset_begins_anew(self):
        self.assertTrue(self.story.reset_answer.success)
        anew = self.story.ears.best[self.story.poses_before_reset]
        p, _ = poses([anew])
        self.assertLess(np.linalg.norm(p[0]), 0.05)
        self.assertLess(stamps([anew])[0], stamps(self.story.best)[-1], "of the same recording, from its start")

    def test_a_recording_played_again_begins_anew(self):
        for name, again in self.story.twice.items():
            t, (p, R) = stamps(again["best"]), poses(again["best"])
            back = np.flatnonzero(np.diff(t) < 0)
            self.assertEqual(len(back), 1, f"{name}: once, to the recording's stamps")
            begin = back[0] + 1
            self.assertLess(np.linalg.norm(p[begin]), 0.05, name)
            for i, j in ((0, begin - 1), (begin, len(t) - 1)):
                a, b = (int(np.argmin(np.abs(self.truth_t - t[n]))) for n in (i, j))
                error = np.linalg.norm(R[i].T @ (p[j] - p[i]) - self.truth_R[a].T @ (self.truth_p[b] - self.truth_p[a]))
                print(f"played again {name}: {j - i} poses, end-to-end error {1000 * error:.1f} mm")
                self.assertGreater(j - i, 2000, name)
                self.assertLess(error, 0.05, name)
            tf = np.array([m.transforms[0].header.stamp.to_nsec() for m in again["transforms"]])
            self.assertEqual(np.count_nonzero(np.diff(tf) < 0), 1, name)
            self.assertLess(tf[-1] - t[-1], 2e8, name)
            way = np.array([m.header.stamp.to_nsec() for m in again["path"].poses])
            self.assertTrue(np.all(np.diff(way) > 0), f"{name}: of the second time alone")
            status = again["status"]
            values = {v.key: v.value for v in status.values}
            self.assertEqual(values["epoch"], "2", name)
            self.assertTrue(any(v.key == "warning" and v.value.startswith("began_anew: ") for v in status.values), status.values)
            self.assertIn("the time went back by", status.message)
            # Of the second time: at error, since the player has ended, and nothing that the first time left.
            self.assertNotIn("diverged", status.message, name)

    def test_lives_without_its_master_and_ends_when_asked(self):
        self.assertTrue(self.story.goes_on)
        self.assertTrue(self.story.alive_without_master)
        self.assertTrue(self.story.found_again, "by the next master")
        self.assertTrue(self.story.fed_again)
        self.assertEqual(self.story.exit_code, 0, self.story.node.lines[-5:])
        print(f"ended {self.story.ended_after:.2f} s after SIGINT")
        self.assertLess(self.story.ended_after, 6)

    def test_can_be_stopped_when_its_master_dies_in_the_middle_of_the_start(self):
        master = ros_world.DyingMaster()
        node = self.story.start_node(f"_config:={self.story.config}", f"__master:={master.uri}")
        master.thread.join(20)
        time.sleep(1.0)
        self.assertTrue(node.running())
        code, seconds = node.end()
        self.assertEqual(code, 0)
        self.assertLess(seconds, 5)

    def test_wrong_parameters_are_named(self):
        master = ros_world.Master(self.story.port)
        self.addCleanup(master.end, signal.SIGKILL)
        config = f"_config:={self.story.config}"
        for parameters, words in ((("_compat:=fast",), ("~compat", "fast_lio")), ((config, "_confg:=x"), ("~confg", "~config")),
                                  ((config, "_tf_rate:=0"), ("~tf_rate",)), ((config, "_set:=lidar.voxelsize=1"), ("lidar.voxel_size",)),
                                  (("_config:=/nowhere.yaml",), ("/nowhere.yaml",)), (("_config:=",), ("~config", "missing"))):
            for name in master.proxy.getParamNames("/test")[2]:
                if name.startswith("/kilvo/"):
                    master.proxy.deleteParam("/test", name)
            node = self.story.start_node(*parameters)
            self.assertEqual(node.wait(20), 2, (parameters, node.lines))
            for word in words:
                self.assertTrue(node.said(word), (parameters, node.lines))

    def test_speaks_as_fast_lio_does(self):
        master = ros_world.Master(self.story.port)
        self.addCleanup(master.end, signal.SIGKILL)
        node = self.story.start_node(f"_config:={self.story.config}", "_compat:=fast_lio")
        self.assertTrue(wait_until(lambda: {"/Odometry", "/cloud_registered", "/path"} <= master.published()), master.published())
        self.assertEqual(node.end(signal.SIGTERM)[0], 0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--node", required=True, help="the program kilvo_node")
    parser.add_argument("--kilvo", required=True, help="the program kilvo")
    parser.add_argument("--speed", type=float, default=1.0, help="of the player")
    ARGUMENTS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest], warnings="ignore")  # rospy leaves its sockets to the collector
