#!/usr/bin/python3
"""The other opinion on ROS 1 bags: Debian's python3-rosbag, which the tests compare with.

rosbag_oracle.py dump BAG                    one line per message: topic, type, recorded ns, and what is in it
rosbag_oracle.py copy IN OUT none|bz2|lz4    takes every message apart, puts it together again, in chunks of 4 kB
"""
import struct
import sys
import zlib

import rosbag


def describe(message) -> list:
    kind = message._type
    if kind == "sensor_msgs/Imu":
        w, a = message.angular_velocity, message.linear_acceleration
        return [w.x, w.y, w.z, a.x, a.y, a.z]
    if kind == "sensor_msgs/JointState":
        return [*message.name, *message.position, *message.velocity, *message.effort]
    if kind == "sensor_msgs/PointCloud2":
        last = (message.width - 1) * message.point_step
        codes = {7: "f", 8: "d"}
        values = [struct.unpack_from("<" + codes[f.datatype], message.data, last + f.offset)[0] for f in message.fields]
        return [message.height, message.width, *(f.name for f in message.fields), *values]
    if kind == "sensor_msgs/Image":
        return [message.width, message.height, message.step, message.encoding, zlib.crc32(message.data)]
    return []


def dump(path: str) -> None:
    with rosbag.Bag(path) as bag:
        for topic, message, time in bag.read_messages():
            words = [v if isinstance(v, str) else f"{v:.17g}" for v in describe(message)]
            print(topic, message._type, time.to_nsec(), message.header.stamp.to_nsec(), message.header.frame_id, *words)


def copy(source: str, target: str, compression: str) -> None:
    with rosbag.Bag(source) as bag, rosbag.Bag(target, "w", compression, 4096) as out:
        for topic, message, time in bag.read_messages():
            out.write(topic, message, time)


if __name__ == "__main__":
    {"dump": dump, "copy": copy}[sys.argv[1]](*sys.argv[2:])
