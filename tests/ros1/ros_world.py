"""A ROS 1 of its own for a test: a master on a free port of this machine, the node, and a player of recordings."""
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import xmlrpc.client


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


def player(bag: str, speed: float, start: float = 0, seconds: float | None = None) -> Process:
    """Plays as fast as it was recorded, times `speed`. It waits a little so that all are connected."""
    length = [] if seconds is None else ["-u", str(seconds)]
    return Process("rosbag", "play", "-q", "-d", "1.0", "-r", str(speed), "-s", str(start), *length, bag)
