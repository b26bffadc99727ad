#!/usr/bin/python3
"""Wrong descriptions of a robot that `kilvo doctor` must find, and how often it names the right culprit.

  confusion.py KILVO RECORDING CONFIG [--only TEXT] [--data] [--until S]

Each case changes the right configuration (or, with --data, the messages: needs python3-rosbag) in one place, runs `kilvo doctor --json`
and compares the findings with what was done. Exit status 1 when a culprit is not named, another one is, or the right description is
accused."""
import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile

import numpy as np
import yaml

import more_cases


def rotation(axis, degrees):
    a = math.radians(degrees)
    c, s = math.cos(a), math.sin(a)
    return {"x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[axis]


def pose(node):
    return np.array(node["R"], float).reshape(3, 3), np.array(node["p"], float)


def texts(key, R=None, p=None):
    out = []
    if R is not None:
        out.append(f"{key}.R=[{', '.join(repr(float(x)) for x in np.asarray(R).flatten())}]")
    if p is not None:
        out.append(f"{key}.p=[{', '.join(repr(float(x)) for x in p)}]")
    return out


def scaled_urdf(text, link, factor):
    """The origins of the joints whose parent is `link`, scaled."""
    def change(joint):
        if not re.search(r'<parent\s+link="%s"' % link, joint.group(0)):
            return joint.group(0)
        return re.sub(r'(<origin[^>]*xyz=")([^"]+)"', lambda m: m.group(1) + " ".join(f"{factor * float(x):.9g}" for x in m.group(2).split()) + '"', joint.group(0))
    return re.sub(r"<joint .*?</joint>", change, text, flags=re.S)


def flipped_axis(text, joint):
    """The axis of this joint the other way round."""
    return re.sub(r'(<joint name="%s".*?<axis xyz=")([^"]+)(")' % joint,
                  lambda m: m.group(1) + " ".join(str(-float(x)) for x in m.group(2).split()) + m.group(3), text, count=1, flags=re.S)


def leg_cases(config, folder, work):
    """Wrong legs of a robot whose joints are named as those of the G1."""
    text = open(os.path.join(folder, config["robot"]["urdf"])).read()
    if "left_knee_link" not in text:
        return []
    out = []

    def urdf(name, changed, right):
        path = os.path.join(work, re.sub("[^a-z0-9]+", "_", name.lower()) + ".urdf")
        open(path, "w").write(changed)
        out.append((name, ["robot.urdf=" + path], right))

    for joint in ("left_hip_pitch", "right_hip_yaw", "left_ankle_pitch", "right_ankle_roll", "right_knee"):
        urdf(f"sign of {joint}", flipped_axis(text, joint + "_joint"), ["joint_sign"])
    urdf("signs of both hip rolls", flipped_axis(flipped_axis(text, "left_hip_roll_joint"), "right_hip_roll_joint"), ["joint_sign"])
    for a, b in (("left_knee", "right_knee"), ("left_hip_yaw", "right_hip_yaw"), ("left_ankle_pitch", "right_ankle_pitch"), ("left_hip_pitch", "left_knee")):
        one, other = f'<joint name="{a}_joint"', f'<joint name="{b}_joint"'
        urdf(f"{a} and {b} exchanged", text.replace(one, "<joint name=@").replace(other, one).replace("<joint name=@", other), ["joints_exchanged", "leg_joints"])
    urdf("knees that bend to the side", re.sub(r'(<joint name="(?:left|right)_knee_joint".*?<axis xyz=")[^"]+', r"\g<1>1 0 0", text, flags=re.S), ["leg_joints"])
    urdf("thigh 10 % longer", scaled_urdf(scaled_urdf(text, "left_hip_yaw_link", 1.1), "right_hip_yaw_link", 1.1), ["leg_lengths"])
    urdf("one shin 10 % longer", scaled_urdf(text, "left_knee_link", 1.1), ["leg_lengths"])
    urdf("legs 10 % shorter", scaled_urdf(scaled_urdf(scaled_urdf(scaled_urdf(
        text, "left_hip_yaw_link", 0.9), "right_hip_yaw_link", 0.9), "left_knee_link", 0.9), "right_knee_link", 0.9), ["leg_lengths"])
    shipped = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "config", "robots")
    other = "g1_12dof.urdf" if "waist_yaw_joint\" type=\"revolute" in text else "sim.urdf"
    locked = ["robot.locked_joints=[waist_yaw_joint]"] if other == "sim.urdf" else []
    out.append(("another robot's URDF", ["robot.urdf=" + os.path.join(shipped, other)] + locked,
                ["leg_lengths", "urdf", "imu_mount_position", "imu_mount_rotation", "imu_link"]))
    feet = config["robot"]["feet"]
    on_shin = [dict(foot, link=foot["link"].replace("ankle_roll", "knee")) for foot in feet]
    out.append(("feet on the shins", ["robot.feet=" + json.dumps(on_shin)], ["foot_link", "urdf", "leg_lengths"]))
    in_mm = [dict(foot, sole=[[1000 * x for x in corner] for corner in foot["sole"]]) for foot in feet]
    out.append(("soles in millimetres", ["robot.feet=" + json.dumps(in_mm)], ["sole_unit"]))
    return out


def mount_cases(config):
    """More wrong mounts, clocks and intrinsics."""
    out = []
    link_R, link_p = pose(config["imu"]["T_link_imu"]) if "T_link_imu" in config["imu"] else (np.eye(3), np.zeros(3))
    if "lidar" in config:
        R, p = pose(config["lidar"]["T_imu_lidar"])
        key = "lidar.T_imu_lidar"
        for name, axis, angle in (("pitched by 10", "y", 10), ("rolled by 3", "x", 3), ("yawed by 2", "z", 2), ("rolled by 90", "x", 90)):
            out.append((f"LiDAR {name}", texts(key, R @ rotation(axis, angle)), ["lidar_rotation"]))
        out.append(("LiDAR's position negated", texts(key, p=-p), ["lidar_position", "lidar_inverted"]))
        out.append(("LiDAR's mount on the link", texts(key, link_R @ R, link_R @ p + link_p), ["lidar_rotation", "lidar_position"]))
        out.append(("LiDAR clock 50 ms", ["lidar.time_offset=0.05"], ["lidar_clock"]))
    if "legs" in config and config["legs"].get("type", "joints") == "joints":
        key = "imu.T_link_imu"
        out.append(("legs' clock 30 ms", ["legs.time_offset=0.03"], ["legs_clock"]))
        out.append(("IMU's mount left out", texts(key, np.eye(3), np.zeros(3)), ["imu_mount_rotation", "imu_mount_position", "imu_link"]))
        out.append(("IMU 10 cm higher on its link", texts(key, p=link_p + [0, 0, 0.1]), ["imu_mount_position", "imu_link"]))
        out.append(("IMU rolled by 180 on its link", texts(key, rotation("x", 180) @ link_R), ["imu_mount_rotation"]))
        out.append(("IMU on the shin", ["imu.T_link_imu.link=left_knee_link" if "ankle" in str(config["robot"]) else "imu.T_link_imu.link=l_lower_leg"],
                    ["imu_link", "imu_mount_rotation"]))
    out.append(("IMU clock -10 ms", ["imu.time_offset=-0.01"], ["imu_clock"] if "lidar" in config else ["imu_clock", "legs_clock"]))
    if "camera" in config:
        R, p = pose(config["camera"]["T_imu_camera"])
        c, key = config["camera"], "camera.T_imu_camera"
        for name, axis, angle in (("rolled by 90", "z", 90), ("yawed by 10", "y", 10), ("rolled by 4", "z", 4)):
            out.append((f"camera {name}", texts(key, R @ rotation(axis, angle)), ["camera_rotation"]))
        for name, off in (("10 cm ahead", [0.1, 0, 0]), ("10 cm to the side", [0, 0.1, 0]), ("10 cm higher", [0, 0, -0.1]), ("20 cm to the side", [0, -0.2, 0])):
            out.append((f"camera {name}", texts(key, p=p + off), ["camera_position"]))
        out.append(("camera's rotation inverted", texts(key, R.T), ["camera_inverted", "camera_rotation"]))
        out.append(("camera's mount on the link", texts(key, link_R @ R, link_R @ p + link_p), ["camera_rotation", "camera_position"]))
        out.append(("camera's cx off by 20 %", [f"camera.cx={1.2 * c['cx']}"], ["camera_principal_point"]))
        out.append(("camera's cy off by 20 %", [f"camera.cy={0.8 * c['cy']}"], ["camera_principal_point"]))
        out.append(("camera's size halved", [f"camera.width={c['width'] // 2}", f"camera.height={c['height'] // 2}"], ["camera_size"]))
        out.append(("camera of half the size", [f"camera.{k}={c[k] / 2:g}" for k in ("fx", "fy", "cx", "cy")], ["camera_focal", "camera_principal_point"]))
        out.append(("camera's fx 10 % longer", [f"camera.fx={1.1 * c['fx']}", f"camera.fy={1.1 * c['fy']}"], ["camera_focal"]))
        out.append(("camera's fy alone 10 % shorter", [f"camera.fy={0.9 * c['fy']}"], ["camera_lens", "camera_focal"]))
        out.append(("camera's fx alone a third longer", [f"camera.fx={1.33 * c['fx']}"], ["camera_lens", "camera_focal"]))
        if any(c.get("distortion", [])):
            out.append(("camera's distortion of the other sign", [f"camera.distortion={[-k for k in c['distortion']]}"], ["camera_lens"]))
        out.append(("camera's fx and fy 1.5 times", [f"camera.fx={1.5 * c['fx']}", f"camera.fy={1.5 * c['fy']}"], ["camera_focal"]))
        for ms in (-50, 100):
            out.append((f"camera's clock {ms} ms", [f"camera.time_offset={ms / 1000}"], ["camera_clock"]))
        out.append(("camera's rate", ["camera.rate=30"], ["camera_rate"]))
    return out


def description_cases(config, folder, work):
    """name, overrides of the configuration, causes of which one is right"""
    out = [("right", [], [])]
    if "lidar" in config:
        R, p = pose(config["lidar"]["T_imu_lidar"])
        key = "lidar.T_imu_lidar"
        for name, axis, degrees in (("rolled by 180", "x", 180), ("yawed by 90", "z", 90), ("pitched by 1", "y", 1), ("pitched by 5", "y", 5), ("pitched by 20", "y", 20)):
            out.append((f"LiDAR {name}", texts(key, R @ rotation(axis, degrees)), ["lidar_rotation"]))
        if np.linalg.norm(R.T @ R.T - np.eye(3)) > 1e-6 or np.linalg.norm(p) > 0.03:
            out.append(("LiDAR inverted", texts(key, R.T, -R.T @ p), ["lidar_inverted", "lidar_position"]))
        out.append(("LiDAR yawed by 180", texts(key, R @ rotation("z", 180)), ["lidar_rotation"]))
        out.append(("LiDAR moved by 10 cm", texts(key, p=p + [0.1, 0, 0]), ["lidar_position"]))
        out.append(("LiDAR moved by 10 cm up", texts(key, p=p + [0, 0, -0.1]), ["lidar_position"]))
        out.append(("LiDAR moved by 3 cm", texts(key, p=p + [0.03, 0, 0]), ["lidar_position"]))
        out.append(("LiDAR's position left out", texts(key, p=0 * p), ["lidar_position"]))
        out.append(("LiDAR's least range in cm", ["lidar.min_range=30"], ["lidar_range"]))
        out.append(("LiDAR position in mm", texts(key, p=1000 * p), ["lidar_position", "lidar_unit"]))
        out.append(("LiDAR position in cm", texts(key, p=100 * p), ["lidar_position", "lidar_unit"]))
        for ms in (5, -20, 100, 1000):
            out.append((f"LiDAR clock {ms} ms", [f"lidar.time_offset={ms / 1000}"], ["lidar_clock"]))
        if "camera" in config:
            out.append(("LiDAR at the camera's place", texts(key, *pose(config["camera"]["T_imu_camera"])), ["lidar_rotation", "lidar_position"]))
        out.append(("LiDAR rate", ["lidar.rate=20"], ["lidar_rate"]))
    if "legs" in config and config["legs"].get("type", "joints") == "joints":
        R, p = pose(config["imu"]["T_link_imu"])
        key = "imu.T_link_imu"
        for ms in (20, -100, 1000):
            out.append((f"legs' clock {ms} ms", [f"legs.time_offset={ms / 1000}"], ["legs_clock"]))
        out.append(("IMU turned by 5 on its link", texts(key, rotation("y", 5) @ R), ["imu_mount_rotation"]))
        out.append(("IMU turned by 90 on its link", texts(key, rotation("z", 90) @ R), ["imu_mount_rotation"]))
        # A mount of half a turn is its own inverse.
        if np.linalg.norm(R.T @ R.T - np.eye(3)) > 0.05 or np.linalg.norm(p + R.T @ p) > 0.03:
            out.append(("IMU's mount inverted", texts(key, R.T, -R.T @ p), ["imu_mount_rotation", "imu_mount_position", "imu_link"]))
        out.append(("IMU on another link", ["imu.T_link_imu.link=" + ("left_hip_pitch_link" if "ankle" in str(config["robot"]) else "l_hip_1")], ["imu_link", "imu_mount_rotation"]))
        feet = config["robot"]["feet"]
        swapped = [dict(feet[0], link=feet[1]["link"]), dict(feet[1], link=feet[0]["link"])]
        out.append(("feet swapped", ["robot.feet=" + json.dumps(swapped)], ["feet_swapped"]))
        urdf = os.path.join(folder, config["robot"]["urdf"])
        text = open(urdf).read()
        for link in ("left_knee_link",):
            if link not in text:
                continue
            longer = scaled_urdf(scaled_urdf(text, link, 1.1), link.replace("left", "right"), 1.1)
            path = os.path.join(work, "shin.urdf")
            open(path, "w").write(longer)
            out.append(("shin 10 % longer", ["robot.urdf=" + path], ["leg_lengths"]))
            path = os.path.join(work, "sign.urdf")
            open(path, "w").write(re.sub(r'(<joint name="left_knee_joint".*?<axis xyz=")([^"]+)(")', lambda m: m.group(1) + " ".join(str(-float(x)) for x in m.group(2).split()) + m.group(3), text, flags=re.S))
            out.append(("knee's sign", ["robot.urdf=" + path], ["joint_sign"]))
            path = os.path.join(work, "hip.urdf")
            open(path, "w").write(re.sub(r'(<joint name="right_hip_roll_joint".*?<axis xyz=")([^"]+)(")', lambda m: m.group(1) + " ".join(str(-float(x)) for x in m.group(2).split()) + m.group(3), text, flags=re.S))
            out.append(("hip roll's sign", ["robot.urdf=" + path], ["joint_sign"]))
        out.append(("IMU turned by 45 on its link", texts(key, rotation("z", 45) @ R), ["imu_mount_rotation"]))
        half = os.path.join(work, "half.urdf")
        open(half, "w").write(re.sub(r'(<origin[^>]*xyz=")([^"]+)"', lambda m: m.group(1) + " ".join(f"{0.5 * float(x):.9g}" for x in m.group(2).split()) + '"', text))
        out.append(("URDF of half the size", ["robot.urdf=" + half], ["leg_lengths", "urdf"]))
        if re.search('name="waist[^"]*" type="revolute"', text) and "waist" not in str(config["robot"].get("locked_joints", "")):
            waist = os.path.join(work, "waist.urdf")
            open(waist, "w").write(re.sub(r'(<joint name="waist[^"]*".*?<axis xyz=")([^"]+)(")', lambda m: m.group(1) + " ".join(str(-float(x)) for x in m.group(2).split()) + m.group(3), text, count=1, flags=re.S))
            out.append(("waist's sign", ["robot.urdf=" + waist], ["joint_sign"]))
        out.append(("legs' rate", ["legs.rate=200"], ["legs_rate"]))
    for ms in (20, 300):
        out.append((f"IMU clock {ms} ms", [f"imu.time_offset={ms / 1000}"], ["imu_clock"] if "lidar" in config else ["imu_clock", "legs_clock"]))
    if "camera" in config:
        R, p = pose(config["camera"]["T_imu_camera"])
        key = "camera.T_imu_camera"
        optical = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
        out.append(("camera in the body frame", texts(key, R @ optical.T), ["camera_frame", "camera_rotation"]))
        out.append(("camera inverted", texts(key, R.T, -R.T @ p), ["camera_inverted", "camera_rotation"]))
        out.append(("camera turned by 5", texts(key, R @ rotation("x", 5)), ["camera_rotation"]))
        out.append(("camera upside down", texts(key, R @ rotation("z", 180)), ["camera_rotation"]))
        out.append(("camera's fx halved", [f"camera.fx={config['camera']['fx'] / 2}"], ["camera_focal"]))
        out.append(("camera's fx and fy halved", [f"camera.fx={config['camera']['fx'] / 2}", f"camera.fy={config['camera']['fy'] / 2}"], ["camera_focal"]))
        out.append(("camera's cx and cy swapped", [f"camera.cx={config['camera']['cy']}", f"camera.cy={config['camera']['cx']}"], ["camera_principal_point"]))
        out.append(("camera position in mm", texts(key, p=1000 * np.copysign(np.maximum(np.abs(p), 0.02), p)), ["camera_unit"]))
        out.append(("camera's size", ["camera.width=1280", "camera.height=1024"], ["camera_size"]))
        for ms in (10, 200):
            out.append((f"camera's clock {ms} ms", [f"camera.time_offset={ms / 1000}"], ["camera_clock"]))
    if "legs" in config and config["legs"].get("type", "joints") == "joints":
        out += leg_cases(config, folder, work)
    return out + mount_cases(config) + more_cases.description_cases(config, folder, work, texts, pose, rotation)


# --- faults of the messages ---------------------------------------------------------------------------------------------------------

def each_imu(change):
    def rewrite(sensor, m):
        if sensor == "imu":
            w = np.array([m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z])
            a = np.array([m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z])
            w, a = change(w, a)
            m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z = w
            m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z = a
        return m
    return rewrite


def each_legs(change):
    def rewrite(sensor, m):
        if sensor == "legs":
            change(m)
        return m
    return rewrite


def turned(R):
    return each_imu(lambda w, a: (R @ w, R @ a))


def swap_sides(m):
    m.name = [n.replace("left", "#").replace("right", "left").replace("#", "right") for n in m.name]


def shift(m):
    m.name = m.name[1:] + m.name[:1]


def exchange_ankles(m):
    m.name = [n.replace("ankle_pitch", "#").replace("ankle_roll", "ankle_pitch").replace("#", "ankle_roll") for n in m.name]


def in_degrees(m):
    m.position = [math.degrees(q) for q in m.position]
    m.velocity = [math.degrees(q) for q in m.velocity]


def offset_of(joint, turn):
    def change(m):
        m.position = [q + (turn if n == joint else 0) for n, q in zip(m.name, m.position)]
    return change


def exchanged(a, b):
    def change(m):
        m.name = [b if n == a else a if n == b else n for n in m.name]
    return change


def exchanged_in_both(a, b):
    def change(m):
        m.name = [n.replace(a, "#").replace(b, a).replace("#", b) for n in m.name]
    return change


def negated(m):
    m.position = [-q for q in m.position]
    m.velocity = [-q for q in m.velocity]


def without_gravity():
    mean = []

    def change(w, a):
        if not mean:
            mean.append(a.copy())
        mean[0] += 0.002 * (a - mean[0])
        return w, a - mean[0]
    return change


def mirrored(sensor, m):
    if sensor == "lidar":
        field = [f for f in m.fields if f.name == "z"][0]
        raw = np.frombuffer(bytearray(m.data), np.uint8).reshape(-1, m.point_step).copy()
        z = -raw[:, field.offset:field.offset + 4].copy().view("<f4")
        raw[:, field.offset:field.offset + 4] = z.view(np.uint8)
        m.data = raw.tobytes()
    return m


def reversed_times(sensor, m):
    if sensor == "lidar":
        field = [f for f in m.fields if f.name in ("timestamp", "time", "t", "offset_time")][0]
        kind = {6: "<u4", 7: "<f4", 8: "<f8"}[field.datatype]
        raw = np.frombuffer(bytearray(m.data), np.uint8).reshape(-1, m.point_step).copy()
        size = int(kind[2])
        t = raw[:, field.offset:field.offset + size].copy().view(kind)[:, 0]
        t = (t.max() - t + t.min()).astype(kind)
        raw[:, field.offset:field.offset + size] = t[:, None].view(np.uint8)
        m.data = raw.tobytes()
    return m


def no_times(sensor, m):
    if sensor == "lidar":
        m.fields = [f for f in m.fields if f.name not in ("timestamp", "time", "t", "offset_time")]
    return m


def data_cases(config):
    flip = np.diag([1.0, -1.0, 1.0])
    out = [("accelerometer in g", each_imu(lambda w, a: (w, a / 9.80665)), ["accel_unit"]),
           ("gyro in deg/s", each_imu(lambda w, a: (np.degrees(w), a)), ["gyro_unit"]),
           ("IMU turned by 90", turned(rotation("z", 90)), ["imu_rotated"]),
           ("IMU turned by 180", turned(rotation("x", 180)), ["imu_rotated"]),
           ("IMU's y flipped", turned(flip), ["imu_axes"]),
           ("gyro's signs flipped", each_imu(lambda w, a: (-w, a)), ["imu_axes"]),
           ("accelerometer's signs flipped", each_imu(lambda w, a: (w, -a)), ["imu_axes"])]
    out += [("gyro's axes permuted", each_imu(lambda w, a: (w[[1, 2, 0]], a)), ["imu_axes"]),
            ("IMU yawed by 45", turned(rotation("z", 45)), ["imu_rotated"]),
            ("accelerometer without gravity", each_imu(without_gravity()), ["accel_gravity"])]
    if "legs" in config:
        out += [("hip pitch off by 90", each_legs(offset_of("left_hip_pitch_joint", math.pi / 2)), ["joint_offset"]),
                ("hip roll and yaw of one leg exchanged", each_legs(exchanged("left_hip_roll_joint", "left_hip_yaw_joint")), ["joints_exchanged"])]
    out += [("gyro's x flipped", each_imu(lambda w, a: (w * [-1, 1, 1], a)), ["imu_axes"]),
            ("accelerometer's z flipped", each_imu(lambda w, a: (w, a * [1, 1, -1])), ["imu_axes"]),
            ("gyro of half the rate", each_imu(lambda w, a: (0.5 * w, a)), ["gyro_unit"])]
    if "legs" in config:
        out += [("knees and ankles exchanged", each_legs(exchanged_in_both("knee", "ankle_pitch")), ["joints_exchanged"]),
                ("hip rolls and yaws exchanged", each_legs(exchanged_in_both("hip_roll", "hip_yaw")), ["joints_exchanged"]),
                ("a knee off by 15 degrees", each_legs(offset_of("right_knee_joint", math.radians(15))), ["joint_offset"]),
                ("a knee off by 5 degrees", each_legs(offset_of("left_knee_joint", math.radians(5))), ["joint_offset"]),
                ("a hip pitch off by 6 degrees", each_legs(offset_of("right_hip_pitch_joint", math.radians(6))), ["joint_offset"]),
                ("a hip roll off by -6 degrees", each_legs(offset_of("left_hip_roll_joint", math.radians(-6))), ["joint_offset"]),
                ("a hip yaw off by 8 degrees", each_legs(offset_of("left_hip_yaw_joint", math.radians(8))), ["joint_offset"]),
                ("all joints the other way round", each_legs(negated), ["joint_sign"])]
    if "lidar" in config:
        out.append(("LiDAR's z flipped", mirrored, ["lidar_axes"]))
    if "legs" in config:
        out += [("joints in degrees", each_legs(in_degrees), ["joint_unit"]), ("left and right swapped", each_legs(swap_sides), ["joints_swapped"]),
                ("names shifted by one", each_legs(shift), ["joint_names_shifted"]),
                ("ankles exchanged", each_legs(exchange_ankles), ["joints_exchanged"])]
    if "lidar" in config:
        out += [("point times reversed", reversed_times, ["point_times_reversed"]), ("point times absent", no_times, ["point_times_absent"])]
    return out + more_cases.data_cases(config, each_imu, each_legs, rotation)


def rewrite(source, target, config, change, topics, until):
    import rosbag
    sensor_of = {topic: sensor for sensor, topic in topics.items()}
    types = {"sensor_msgs/Imu": "imu", "sensor_msgs/JointState": "legs", "sensor_msgs/PointCloud2": "lidar"}
    with rosbag.Bag(source) as bag, rosbag.Bag(target, "w") as out:
        begin = None
        for topic, message, t in bag.read_messages(topics=[x for x in topics.values()] + [x + "/compressed" for x in topics.values()]):
            begin = begin or t
            if (t - begin).to_sec() > until:
                break
            kind = types.get(message._type)
            if sensor_of.get(topic) == kind:
                message = change(kind, message)
            out.write(topic, message, t)


def judge(kilvo, recording, config, overrides):
    command = [kilvo, "doctor", recording, "--config", config, "--json"]
    for text in overrides:
        command += ["--set", text]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 1, 3) or not done.stdout:
        return None, done.stderr.strip()
    return json.loads(done.stdout), done.stderr.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kilvo")
    parser.add_argument("recording")
    parser.add_argument("config")
    parser.add_argument("--only", default="", help="only cases whose name holds this text (a regular expression)")
    parser.add_argument("--data", action="store_true", help="faults of the messages instead of the configuration")
    parser.add_argument("--until", type=float, default=30, help="seconds of the recording that rewritten ones keep")
    arguments = parser.parse_args()
    config = yaml.safe_load(open(arguments.config))
    work = tempfile.mkdtemp(prefix="confusion-")
    rows = []
    if arguments.data:
        cases = [(name, None, right, change) for name, change, right in data_cases(config)]
    else:
        cases = [(name, overrides, right, None) for name, overrides, right in description_cases(config, os.path.dirname(os.path.abspath(arguments.config)), work)]
    named = accused = 0
    for name, overrides, right, change in cases:
        if not re.search(arguments.only, name):
            continue
        recording = arguments.recording
        if change is not None:
            recording = os.path.join(work, "case.bag")
            topics = {s: config[s]["topic"] for s in ("imu", "legs", "lidar", "camera") if s in config}
            source = os.path.join(arguments.recording, "recording.bag") if os.path.isdir(arguments.recording) else arguments.recording
            rewrite(source, recording, config, change, topics, arguments.until)
        result, error = judge(arguments.kilvo, recording, arguments.config, overrides or [])
        found = [f["cause"] for f in result["findings"]] if result else ["refused: " + error[:120]]
        good = any(c in right for c in found) if right else not found
        others = [c for c in found if c not in right]
        named += good
        accused += bool(others)
        rows.append((name, good, others))
        print(f"{'ok ' if good and not others else 'NO '} {name:34} expected {'/'.join(right) or '-':40} found {', '.join(found) or '-'}", flush=True)
    print(f"{named} of {len(rows)} named, {accused} with another accusation")
    return 0 if named == len(rows) and accused == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
