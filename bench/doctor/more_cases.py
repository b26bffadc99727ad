"""Wrong descriptions and messages as users make them that the doctor was not written against: beside those of confusion.py."""
import json
import math
import os
import re

import numpy as np

UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0])


def quaternion(R):
    """w, x, y, z"""
    w = math.sqrt(max(0, 1 + R[0, 0] + R[1, 1] + R[2, 2])) / 2
    x, y, z = (math.copysign(math.sqrt(max(0, 1 + 2 * R[i, i] - np.trace(R))) / 2, s)
               for i, s in ((0, R[2, 1] - R[1, 2]), (1, R[0, 2] - R[2, 0]), (2, R[1, 0] - R[0, 1])))
    return np.array([w, x, y, z])


def rotation_of(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def other_order(R):
    """The rotation whose quaternion was written as w, x, y, z and read as x, y, z, w."""
    w, x, y, z = quaternion(R)
    return rotation_of(np.array([z, w, x, y]))


def any_rotations():
    """Five rotations that have nothing to do with the axes."""
    rng = np.random.default_rng(7)
    quaternions = rng.normal(size=(5, 4))
    return [rotation_of(q / np.linalg.norm(q)) for q in quaternions]


def turned_anyhow(sensor, key, R, texts, cause):
    return [(f"{sensor} turned anyhow, {i}", texts(key, any_R @ R), [cause]) for i, any_R in enumerate(any_rotations())]


def differ(A, B, degrees=3):
    return math.degrees(math.acos(max(-1, min(1, (np.trace(A.T @ B) - 1) / 2)))) > degrees


def mount_cases(config, texts, pose, rotation):
    out = []
    R, p = pose(config["lidar"]["T_imu_lidar"])
    key = "lidar.T_imu_lidar"
    if differ(other_order(R), R):
        out.append(("LiDAR's quaternion in another order", texts(key, other_order(R)), ["lidar_rotation"]))
    out.append(("LiDAR of the robot with the tilted mount", texts(key, R @ rotation("y", 22), p + [0.01, 0, 0.11]), ["lidar_rotation", "lidar_position"]))
    out.append(("LiDAR described upright", texts(key, R @ UPSIDE_DOWN), ["lidar_rotation"]))
    out.append(("LiDAR's place with y negated", texts(key, p=p * [1, -1, 1] + [0, 0.03 if abs(p[1]) < 0.03 else 0, 0]), ["lidar_position"]))
    for ms in (-50, 8):
        out.append((f"LiDAR's time_offset {ms} ms", [f"lidar.time_offset={ms / 1000}"], ["lidar_clock"]))
    return out + turned_anyhow("LiDAR", key, R, texts, "lidar_rotation")


def leg_cases(config, folder, work, texts, pose, rotation):
    out = []
    R, p = pose(config["imu"]["T_link_imu"])
    key = "imu.T_link_imu"
    if differ(other_order(R), R):
        out.append(("IMU's quaternion in another order", texts(key, other_order(R)), ["imu_mount_rotation"]))
    out += turned_anyhow("IMU", key, R, texts, "imu_mount_rotation")
    out.append(("IMU described upright", texts(key, R @ UPSIDE_DOWN), ["imu_mount_rotation"]))
    out.append(("IMU's place in millimetres", texts(key, p=1000 * p), ["imu_mount_position"]))
    out.append(("IMU pitched by 8", texts(key, rotation("y", 8) @ R), ["imu_mount_rotation"]))
    out.append(("IMU yawed by 180 on its link", texts(key, rotation("z", 180) @ R), ["imu_mount_rotation"]))
    for ms in (-20, -40):
        out.append((f"legs' time_offset {ms} ms", [f"legs.time_offset={ms / 1000}"], ["legs_clock"]))
    text = open(os.path.join(folder, config["robot"]["urdf"])).read()

    def urdf(name, changed, right):
        path = os.path.join(work, re.sub("[^a-z0-9]+", "_", name.lower()) + ".urdf")
        open(path, "w").write(changed)
        out.append((name, ["robot.urdf=" + path], right))

    def origins(text, joints, change):
        def at(joint):
            if not re.search(joints, re.search(r'name="([^"]*)"', joint.group(0)).group(1)):
                return joint.group(0)
            return re.sub(r'(<origin[^>]*xyz=")([^"]+)"', lambda m: m.group(1) + " ".join(f"{x:.9g}" for x in change([float(x) for x in m.group(2).split()])) + '"', joint.group(0))
        return re.sub(r"<joint .*?</joint>", at, text, flags=re.S)

    urdf("URDF in millimetres", origins(text, ".", lambda x: [1000 * a for a in x]), ["urdf", "leg_lengths"])
    urdf("hips 5 cm wider", origins(text, "hip_(roll|pitch)", lambda x: [x[0], x[1] + math.copysign(0.05, x[1]) if abs(x[1]) > 0.03 else x[1], x[2]]), ["urdf", "leg_lengths"])
    urdf("shins 15 % shorter", origins(text, "ankle_pitch", lambda x: [0.85 * a for a in x]), ["leg_lengths"])
    urdf("shins 5 % longer", origins(text, "ankle_pitch", lambda x: [1.05 * a for a in x]), ["leg_lengths"])
    urdf("one shin 5 % longer", origins(text, "left_ankle_pitch", lambda x: [1.05 * a for a in x]), ["leg_lengths"])
    urdf("thighs 7 % longer", origins(text, "knee", lambda x: [1.07 * a for a in x]), ["leg_lengths"])

    def flipped(text, joint):
        return re.sub(r'(<joint name="%s".*?<axis xyz=")([^"]+)(")' % joint,
                      lambda m: m.group(1) + " ".join(str(-float(x)) for x in m.group(2).split()) + m.group(3), text, count=1, flags=re.S)

    mirrored = text
    for joint in ("right_hip_roll_joint", "right_hip_yaw_joint", "right_ankle_roll_joint"):
        mirrored = flipped(mirrored, joint)
    urdf("rolls and yaws of the right leg mirrored", mirrored, ["joint_sign"])
    urdf("both ankle pitches the other way round", flipped(flipped(text, "left_ankle_pitch_joint"), "right_ankle_pitch_joint"), ["joint_sign"])
    feet = config["robot"]["feet"]
    turned = [dict(foot, sole=[[-c[0], c[1], c[2]] for c in foot["sole"]]) for foot in feet]
    out.append(("soles turned round", ["robot.feet=" + json.dumps(turned)], []))
    raised = [dict(foot, sole=[[c[0], c[1], -c[2]] for c in foot["sole"]]) for foot in feet]
    out.append(("soles above the ankles", ["robot.feet=" + json.dumps(raised)], ["leg_lengths", "foot_link", "sole_height"]))
    return out


def camera_cases(config, texts, pose, rotation):
    R, p = pose(config["camera"]["T_imu_camera"])
    c, key, out = config["camera"], "camera.T_imu_camera", []
    out.append(("camera's quaternion in another order", texts(key, other_order(R)), ["camera_rotation", "camera_inverted", "camera_frame"]))
    out.append(("camera mirrored left to right", texts(key, R @ rotation("y", 180)), ["camera_rotation"]))
    out.append(("camera's intrinsics of the full sensor", [f"camera.{k}={2 * c[k]:g}" for k in ("fx", "fy", "cx", "cy")], ["camera_focal", "camera_principal_point"]))
    out.append(("camera's fx and fy swapped with cx and cy", [f"camera.{a}={c[b]:g}" for a, b in (("fx", "cx"), ("fy", "cy"), ("cx", "fx"), ("cy", "fy"))], ["camera_focal", "camera_principal_point"]))
    return out + turned_anyhow("camera", key, R, texts, "camera_rotation")


def description_cases(config, folder, work, texts, pose, rotation):
    out = [("IMU's rate", ["imu.rate=1000"], ["imu_rate"])]
    if "lidar" in config:
        out += mount_cases(config, texts, pose, rotation)
    if "legs" in config and config["legs"].get("type", "joints") == "joints":
        out += leg_cases(config, folder, work, texts, pose, rotation)
    return out + (camera_cases(config, texts, pose, rotation) if "camera" in config else [])


# --- faults of the messages ---------------------------------------------------------------------------------------------------------

def one_leg_twice(m):
    place = {n: i for i, n in enumerate(m.name)}
    m.position = [m.position[place[n.replace("right", "left")]] for n in m.name]
    m.velocity = [m.velocity[place[n.replace("right", "left")]] for n in m.name]


def right_leg_mirrored(m):
    turns = [-1 if n.startswith("right") and ("roll" in n or "yaw" in n) else 1 for n in m.name]
    m.position = [s * q for s, q in zip(turns, m.position)]
    m.velocity = [s * q for s, q in zip(turns, m.velocity)]


def speed_in_rpm(m):
    m.velocity = [q * 60 / (2 * math.pi) for q in m.velocity]


def frozen(joint):
    first = []

    def change(m):
        i = list(m.name).index(joint)
        first.append(m.position[i])
        q, v = list(m.position), list(m.velocity)
        q[i], v[i] = first[0], 0.0
        m.position, m.velocity = q, v
    return change


def points_by(M):
    def change(sensor, m):
        if sensor == "lidar":
            at = {f.name: f.offset for f in m.fields}
            raw = np.frombuffer(bytearray(m.data), np.uint8).reshape(-1, m.point_step).copy()
            xyz = np.concatenate([raw[:, at[k]:at[k] + 4].copy().view("<f4") for k in "xyz"], axis=1) @ np.asarray(M).T
            for i, k in enumerate("xyz"):
                raw[:, at[k]:at[k] + 4] = xyz[:, i:i + 1].astype("<f4").copy().view(np.uint8)
            m.data = raw.tobytes()
        return m
    return change


def data_cases(config, each_imu, each_legs, rotation):
    swap = np.eye(3)[[1, 0, 2]]
    out = [("accelerometer in mg", each_imu(lambda w, a: (w, a / 9.80665e-3)), ["accel_unit"]),
           ("gyro's bias removed", each_imu(lambda w, a: (w - 0.002, a)), []),
           ("x and y of the IMU swapped", each_imu(lambda w, a: (swap @ w, swap @ a)), ["imu_axes"]),
           ("gyro turned by 90", each_imu(lambda w, a: (rotation("z", 90) @ w, a)), ["imu_axes", "imu_rotated"]),
           ("accelerometer's axes permuted", each_imu(lambda w, a: (w, a[[2, 0, 1]])), ["imu_axes"]),
           ("gyro 10 % too fast", each_imu(lambda w, a: (1.1 * w, a)), ["gyro_unit"])]
    if "lidar" in config:
        out += [("LiDAR's x and y swapped", points_by(swap), ["lidar_axes"]), ("points in centimetres", points_by(100 * np.eye(3)), ["lidar_unit"]),
                ("points in millimetres", points_by(1000 * np.eye(3)), ["lidar_unit"]), ("points 5 % too far", points_by(1.05 * np.eye(3)), ["lidar_unit"])]
    if "legs" in config:
        out += [("one leg in both", each_legs(one_leg_twice), ["joints_repeated"]),
                ("right leg's rolls and yaws negated", each_legs(right_leg_mirrored), ["joint_sign"]),
                ("joint speeds in rpm", each_legs(speed_in_rpm), ["joint_unit", "joint_velocity"]),
                ("a knee that shows its first angle", each_legs(frozen("left_knee_joint")), ["joint_frozen"])]
    return out
