"""mcap_from_json.py DIR [--out OUT] [--read PROGRAM]: the conformance files of MCAP (foxglove/mcap, tests/conformance/data) made anew from
the JSON beside each: a checkout without git-lfs has pointers in their place. What is made must have the SHA-256 that the pointer names, or be
the file that is there, byte for byte. PROGRAM (mcap_conformance) then reads them. Exit code 77: there is no such DIR."""
import argparse
import hashlib
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

SKIPPED = 77
MAGIC = b"\x89MCAP0\r\n"
PADDING = b"\x01\xff\xff"
OPCODES = {"Header": 1, "Footer": 2, "Schema": 3, "Channel": 4, "Message": 5, "ChunkIndex": 8, "Attachment": 9, "AttachmentIndex": 10,
           "Statistics": 11, "Metadata": 12, "MetadataIndex": 13, "SummaryOffset": 14, "DataEnd": 15}


def number(kind: str):
    return lambda value: struct.pack("<" + kind, int(value))


def text(value: str) -> bytes:
    return number("I")(len(value.encode())) + value.encode()


def plain(value: list) -> bytes:
    return bytes(int(byte) for byte in value)


def sized(of: str):
    return lambda value: number(of)(len(value)) + plain(value)


def table(key, entry):
    def encode(value: dict) -> bytes:
        inner = b"".join(key(k) + entry(v) for k, v in value.items())
        return number("I")(len(inner)) + inner
    return encode


u16, u32, u64 = number("H"), number("I"), number("Q")
LAYOUTS = {  # in the order of the format's specification
    "Header": {"profile": text, "library": text},
    "Footer": {"summary_start": u64, "summary_offset_start": u64, "summary_crc": u32},
    "Schema": {"id": u16, "name": text, "encoding": text, "data": sized("I")},
    "Channel": {"id": u16, "schema_id": u16, "topic": text, "message_encoding": text, "metadata": table(text, text)},
    "Message": {"channel_id": u16, "sequence": u32, "log_time": u64, "publish_time": u64, "data": plain},
    "ChunkIndex": {"message_start_time": u64, "message_end_time": u64, "chunk_start_offset": u64, "chunk_length": u64,
                   "message_index_offsets": table(u16, u64), "message_index_length": u64, "compression": text, "compressed_size": u64,
                   "uncompressed_size": u64},
    "Attachment": {"log_time": u64, "create_time": u64, "name": text, "media_type": text, "data": sized("Q")},
    "AttachmentIndex": {"offset": u64, "length": u64, "log_time": u64, "create_time": u64, "data_size": u64, "name": text, "media_type": text},
    "Statistics": {"message_count": u64, "schema_count": u16, "channel_count": u32, "attachment_count": u32, "metadata_count": u32,
                   "chunk_count": u32, "message_start_time": u64, "message_end_time": u64, "channel_message_counts": table(u16, u64)},
    "Metadata": {"name": text, "metadata": table(text, text)},
    "MetadataIndex": {"offset": u64, "length": u64, "name": text},
    "SummaryOffset": {"group_opcode": number("B"), "group_start": u64, "group_length": u64},
    "DataEnd": {"data_section_crc": u32},
}


def framed(opcode: int, content: bytes) -> bytes:
    return bytes([opcode]) + u64(len(content)) + content


def written(record: dict, padding: bytes = b"") -> bytes:
    """`padding`: bytes behind the known fields, which a reader must ignore."""
    fields = dict(record["fields"])
    content = b"".join(encode(fields[name]) for name, encode in LAYOUTS[record["type"]].items())
    if record["type"] == "Attachment":
        content += u32(zlib.crc32(content))
    return framed(OPCODES[record["type"]], content + (padding if record["type"] not in ("Message", "DataEnd", "Footer") else b""))


def chunk(records: list, with_index: bool, padding: bytes) -> bytes:
    """Of these records, not compressed; with the index of the messages of each channel behind it, which alone is padded."""
    inner, entries = b"", {}
    for record in records:
        fields = dict(record["fields"])
        if record["type"] == "Message":
            entries.setdefault(fields["channel_id"], []).append((int(fields["log_time"]), len(inner)))
        inner += written(record)
    times = [time for channel in entries.values() for time, _ in channel]
    out = framed(6, u64(min(times)) + u64(max(times)) + u64(len(inner)) + u32(zlib.crc32(inner)) + text("") + u64(len(inner)) + inner)
    for channel, places in entries.items() if with_index else ():
        index = b"".join(u64(time) + u64(offset) for time, offset in places)
        out += framed(7, u16(channel) + u32(len(index)) + index + padding)
    return out


def content_of(description: dict) -> bytes:
    features = description["meta"]["variant"]["features"]
    padding = PADDING if "pad" in features else b""
    records = description["records"]
    end = next(i for i, record in enumerate(records) if record["type"] == "DataEnd")
    if "ch" in features:
        data = chunk(records[1:end], "mx" in features, padding)
    else:
        data = b"".join(written(record, padding) for record in records[1:end])
    return MAGIC + written(records[0], padding) + data + b"".join(written(record, padding) for record in records[end:]) + MAGIC


def make(folder: pathlib.Path, out: pathlib.Path) -> tuple[int, int]:
    """How many were made, and how many of them are not the originals."""
    made = differing = 0
    for path in sorted(folder.rglob("*.json")):
        target = out / path.relative_to(folder)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, target)
        content = content_of(json.loads(path.read_text(encoding="utf-8")))
        target.with_suffix(".mcap").write_bytes(content)
        given = path.with_suffix(".mcap").read_bytes()
        is_pointer = given.startswith(b"version https://git-lfs")
        same = hashlib.sha256(content).hexdigest().encode() in given if is_pointer else content == given
        made += 1
        differing += not same
        if not same:
            print(f"{path.with_suffix('.mcap').name}: {len(content)} bytes are not those of the original")
    return made, differing


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--read")
    parser.add_argument("--expect", type=int, help="so many files")
    args = parser.parse_args()
    if not args.folder.is_dir():
        return SKIPPED
    with tempfile.TemporaryDirectory() as temporary:
        out = args.out or pathlib.Path(temporary)
        made, differing = make(args.folder, out)
        print(f"{made} files made, {differing} other than the originals", flush=True)
        code = subprocess.run([args.read, str(out)], check=False).returncode if args.read else 0
    return 0 if made == (args.expect or made) and made > 0 and differing == 0 and code == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
