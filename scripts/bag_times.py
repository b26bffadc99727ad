"""Edits the times of a recording: when its messages arrived, and the stamps in them. For uncompressed ROS 1 bags, as `kilvo simulate` writes."""
import struct
from typing import Callable, Iterator

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 4, 5, 6, 7
POINTS = "/points"  # of sensor_msgs/PointCloud2
STAMP = 4  # of a message that begins with std_msgs/Header: behind its sequence number

# Takes a topic, the seconds of arrival since the first message, the arrival and the stamp (ns); gives the new arrival and stamp.
Edit = Callable[[str, float, int, int], tuple[int, int]]


def records(bag: bytearray, begin: int, end: int) -> Iterator[tuple[dict[str, int], int, int]]:
    """Each record between two places: where the values of its header begin, where its data begin and end."""
    while begin < end:
        at = begin + 4
        header_end = at + struct.unpack_from("<I", bag, begin)[0]
        fields = {}
        while at < header_end:
            (size,) = struct.unpack_from("<I", bag, at)
            name = bag[at + 4:at + 4 + size].partition(b"=")[0]
            fields[name.decode()] = at + 5 + len(name)
            at += 4 + size
        (size,) = struct.unpack_from("<I", bag, at)
        begin = at + 4 + size
        yield fields, at + 4, begin


def read_time(bag: bytearray, at: int) -> int:
    seconds, nanoseconds = struct.unpack_from("<II", bag, at)
    return seconds * 10**9 + nanoseconds


def write_time(bag: bytearray, at: int, ns: int) -> None:
    struct.pack_into("<II", bag, at, *divmod(ns, 10**9))


def number(bag: bytearray, at: int) -> int:
    return struct.unpack_from("<I", bag, at)[0]


def shift_points(bag: bytearray, at: int, by: int) -> None:
    """The times of the points of the sensor_msgs/PointCloud2 at this place, as far as they are absolute: of its field "timestamp"."""
    def text() -> bytes:
        nonlocal at
        length = number(bag, at)
        at += 4 + length
        return bytes(bag[at - length:at])

    at += 12  # sequence number, stamp
    text()    # frame
    at += 8   # height, width
    fields = {}
    at += 4
    for _ in range(number(bag, at - 4)):
        name = text()
        fields[name] = number(bag, at)
        at += 9
    step, size = number(bag, at + 1), number(bag, at + 9)
    if b"timestamp" not in fields:
        return
    for point in range(at + 13 + fields[b"timestamp"], at + 13 + size, step):
        (time,) = struct.unpack_from("<d", bag, point)
        struct.pack_into("<d", bag, point, time + by)


def edit_times(bag: bytearray, edit: Edit) -> None:
    topics: dict[int, str] = {}
    arrivals: dict[int, dict[int, int]] = {}  # by chunk, by place within it
    chunk_at = chunk_data = 0
    first = None
    at = len(MAGIC)
    for fields, data, end in records(bag, at, len(bag)):
        op = bag[fields["op"]]
        if op == CHUNK:
            chunk_at, chunk_data = at, data
            arrivals[chunk_at] = {}
            inner_at = data
            for inner, inner_data, inner_end in records(bag, data, end):
                connection = number(bag, inner["conn"])
                if bag[inner["op"]] == CONNECTION:
                    length = number(bag, inner["topic"] - 10)
                    topics[connection] = bag[inner["topic"]:inner["topic"] - 6 + length].decode()
                elif bag[inner["op"]] == MESSAGE:
                    arrival, stamp = read_time(bag, inner["time"]), read_time(bag, inner_data + STAMP)
                    first = arrival if first is None else first
                    was = stamp
                    arrival, stamp = edit(topics[connection], (arrival - first) / 1e9, arrival, stamp)
                    if topics[connection] == POINTS and stamp != was:
                        shift_points(bag, inner_data, stamp - was)
                    write_time(bag, inner["time"], arrival)
                    write_time(bag, inner_data + STAMP, stamp)
                    arrivals[chunk_at][inner_at - chunk_data] = arrival
                inner_at = inner_end
        elif op == INDEX:
            for entry in range(data, end, 12):
                write_time(bag, entry, arrivals[chunk_at][number(bag, entry + 8)])
        elif op == CHUNK_INFO:
            (position,) = struct.unpack_from("<Q", bag, fields["chunk_pos"])
            write_time(bag, fields["start_time"], min(arrivals[position].values()))
            write_time(bag, fields["end_time"], max(arrivals[position].values()))
        at = end
