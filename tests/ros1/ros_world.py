"""A ROS 1 of its own for a test: a master on a free port of this machine, the node, and a player of recordings."""
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import xmlrpc.client
import xmlrpc.server
import zlib


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def settle(folder: str) -> int:
    """Makes this process and its children use a master at a port that nobody has; before rospy is imported."""
    port = free_port()
    for name in ("ROS_NAMESPACE", "ROS_HOSTNAME"):
        os.environ.pop(name, None)
    os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_LOG_DIR=folder, ROS_HOME=folder)
    return port


def wait_until(what, seconds: float = 30.0) -> bool:
    """Whether `what()` has come true within a time that only a broken program needs."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if what():
            return True
        time.sleep(0.02)
    return bool(what())


class Process:
    """A program whose words are kept."""

    def __init__(self, *command: str):
        self.lines: list[str] = []
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def said(self, text: str) -> bool:
        return any(text in line for line in self.lines)

    def running(self) -> bool:
        return self.process.poll() is None

    def end(self, with_signal: int = signal.SIGINT, seconds: float = 20.0) -> tuple[int, float]:
        """Its exit code, and how long it took to end."""
        begin = time.monotonic()
        self.process.send_signal(with_signal)
        code = self.wait(seconds)
        return code, time.monotonic() - begin

    def wait(self, seconds: float = 120.0) -> int:
        try:
            code = self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            code = -signal.SIGKILL
        self.reader.join(5)
        return code


class Master(Process):
    def __init__(self, port: int):
        super().__init__(sys.executable, "-c", "import sys, rosmaster; rosmaster.rosmaster_main(sys.argv[1:])", "--core", "-p", str(port))
        self.proxy = xmlrpc.client.ServerProxy(f"http://127.0.0.1:{port}")
        assert wait_until(self.is_there), self.lines

    def is_there(self) -> bool:
        try:
            return self.proxy.getPid("/test")[0] == 1
        except OSError:
            return False

    def subscribed(self, topic: str) -> bool:
        """Whether the node listens to a topic."""
        return any(name == topic and "/kilvo" in nodes for name, nodes in self.proxy.getSystemState("/test")[2][1])

    def published(self) -> set[str]:
        return {name for name, nodes in self.proxy.getSystemState("/test")[2][0] if "/kilvo" in nodes}


def player(bag: str, speed: float, start: float = 0, seconds: float | None = None, clock: bool = False) -> Process:
    """Plays as fast as it was recorded, times `speed`. It waits a little so that all are connected. `clock`: it tells what time it is."""
    length = [] if seconds is None else ["-u", str(seconds)]
    return Process("rosbag", "play", "-q", "-d", "1.0", "-r", str(speed), "-s", str(start), *length, *(["--clock"] if clock else []), bag)


def png(height: int, width: int, rgb: bytes) -> bytes:
    """A picture of eight bits a colour as a PNG file."""
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + rgb[3 * i * width:3 * (i + 1) * width] for i in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


LIVOX = """std_msgs/Header header
uint64 timebase
uint32 point_num
uint8 lidar_id
uint8[3] rsvd
{package}/CustomPoint[] points
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: {package}/CustomPoint
uint32 offset_time
float32 x
float32 y
float32 z
uint8 reflectivity
uint8 tag
uint8 line
"""


class Body:
    """Where the ankles are on the torso, by the robot's URDF: what a robot knows that sends its feet instead of its joints."""

    LINK, FEET = "torso_link", ("left_ankle_roll_link", "right_ankle_roll_link")

    def __init__(self, urdf: str):
        import xml.etree.ElementTree
        numbers = lambda text: [float(word) for word in text.split()]
        self.joint_above = {}  # of each link
        for joint in xml.etree.ElementTree.parse(urdf).getroot().iter("joint"):
            origin, axis = joint.find("origin"), joint.find("axis")
            assert not any(numbers(origin.get("rpy", "0 0 0")))
            self.joint_above[joint.find("child").get("link")] = (joint.get("name"), joint.find("parent").get("link"), numbers(origin.get("xyz")),
                                                                 numbers(axis.get("xyz")) if axis is not None else None)

    def pose(self, link: str, angles: dict):
        """Of a link on the URDF's root: rotation and position."""
        import numpy as np
        if link not in self.joint_above:
            return np.eye(3), np.zeros(3)
        name, parent, origin, axis = self.joint_above[link]
        R, p = self.pose(parent, angles)
        p = p + R @ np.array(origin)
        if axis is not None:
            x, y, z = axis
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            a = angles.get(name, 0.0)
            R = R @ (np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K)
        return R, p

    def feet(self, angles: dict) -> list:
        R, p = self.pose(self.LINK, angles)
        return [x for foot in self.FEET for x in R.T @ (self.pose(foot, angles)[1] - p)]

    def message(self, joints):
        """The two-feet message: six positions and six velocities without names."""
        from sensor_msgs.msg import JointState
        dt = 1e-4
        now = dict(zip(joints.name, joints.position))
        later = {name: angle + dt * rate for name, angle, rate in zip(joints.name, joints.position, joints.velocity)}
        position = self.feet(now)
        return JointState(header=joints.header, position=position, velocity=[(b - a) / dt for a, b in zip(position, self.feet(later))])


def with_two_feet(config: str, target: str) -> str:
    """The configuration for such messages."""
    import yaml
    with open(config, encoding="utf-8") as file:
        settings = yaml.safe_load(file)
    mount = settings["imu"]["T_link_imu"]  # x_link = R x_imu + p
    R, p = [mount["R"][i:i + 3] for i in (0, 3, 6)], mount["p"]
    turned = [R[j][i] for i in range(3) for j in range(3)]
    settings["legs"] = {**settings["legs"], "type": "feet", "sole_offset": 0.035,
                        "T_imu_feet": {"R": turned, "p": [-sum(turned[3 * i + j] * p[j] for j in range(3)) for i in range(3)]}}
    with open(target, "w", encoding="utf-8") as file:
        yaml.safe_dump(settings, file)
    return target


def to_other_types(source: str, target: str, seconds: float, livox_package: str, body: Body | None = None) -> None:
    """The beginning of a recording again, its clouds as Livox's driver writes them and its images compressed; with `body` its legs as feet."""
    import genpy.dynamic
    import numpy as np
    import rosbag
    from sensor_msgs.msg import CompressedImage
    types = genpy.dynamic.generate_dynamic(f"{livox_package}/CustomMsg", LIVOX.format(package=livox_package))
    cloud_type, point_type = types[f"{livox_package}/CustomMsg"], types[f"{livox_package}/CustomPoint"]
    with rosbag.Bag(source) as bag, rosbag.Bag(target, "w") as out:
        begin = bag.get_start_time()
        for topic, message, t in bag.read_messages():
            if t.to_sec() - begin > seconds:
                break
            if message._type == "sensor_msgs/PointCloud2":
                at = {f.name: f.offset for f in message.fields}
                kinds = np.dtype({"names": ["x", "y", "z", "intensity", "time"],
                                  "formats": ["<f4", "<f4", "<f4", "<f4", "<f8"],
                                  "offsets": [at["x"], at["y"], at["z"], at["intensity"], at["timestamp"]], "itemsize": message.point_step})
                points = np.frombuffer(message.data, dtype=kinds)[::3]  # for speed
                stamp = message.header.stamp.to_nsec()
                offsets = (points["time"] - stamp).astype(np.int64)
                cloud = cloud_type(header=message.header, timebase=stamp, point_num=len(points), lidar_id=0, rsvd=b"\0\0\0")
                cloud.points = [point_type(int(o), p["x"], p["y"], p["z"], int(min(255, p["intensity"])), 0, 0)
                                for o, p in zip(offsets, points) if o >= 0]
                out.write(topic, cloud, t)
            elif message._type == "sensor_msgs/Image":
                if message.encoding != "rgb8":
                    raise ValueError(message.encoding)
                out.write(topic + "/compressed", CompressedImage(header=message.header, format="png",
                                                                 data=png(message.height, message.width, message.data)), t)
            elif body is not None and message._type == "sensor_msgs/JointState":
                out.write(topic, body.message(message), t)
            else:
                out.write(topic, message, t)


class DyingMaster:
    """Answers who it is, once, and is gone."""

    def __init__(self):
        self.server = xmlrpc.server.SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self.uri = "http://127.0.0.1:%d" % self.server.server_address[1]
        self.server.register_function(lambda caller: (1, "", 1), "getPid")
        self.thread = threading.Thread(target=self._serve)
        self.thread.start()

    def _serve(self) -> None:
        self.server.handle_request()
        self.server.server_close()
