"""rosbag2_bags.py DIR --kilvo PROGRAM: every folder below DIR that holds a recording of rosbag2 is listed by `kilvo info` and read whole by
`kilvo convert`, with as many messages of each topic as SQLite and metadata.yaml say. Exit code 77: there is no such DIR."""
import argparse
import collections
import pathlib
import re
import sqlite3
import subprocess
import sys
import tempfile

SKIPPED = 77


def counts_of_metadata(folder: pathlib.Path) -> dict:
    import yaml

    with open(folder / "metadata.yaml", encoding="utf-8") as file:
        topics = yaml.safe_load(file)["rosbag2_bagfile_information"]["topics_with_message_count"]
    return {topic["topic_metadata"]["name"]: topic["message_count"] for topic in topics}


def counts_of_sqlite(folder: pathlib.Path) -> dict:
    out = collections.Counter()
    for file in sorted(folder.glob("*.db3")):
        with sqlite3.connect(f"file:{file}?mode=ro&immutable=1", uri=True) as database:
            out.update(dict(database.execute("SELECT name, (SELECT count(*) FROM messages WHERE topic_id = topics.id) FROM topics")))
    return dict(out)


def listed(kilvo: str, recording: pathlib.Path) -> dict:
    text = subprocess.run([kilvo, "info", str(recording)], check=True, capture_output=True, text=True).stdout
    return {topic: int(count) for topic, count in re.findall(r"^(\S+) +\w+/\w+ +(\d+) ", text, re.M)}


def fault_of(kilvo: str, folder: pathlib.Path) -> str:
    own = counts_of_metadata(folder) if (folder / "metadata.yaml").exists() else counts_of_sqlite(folder)
    found = listed(kilvo, folder)
    if own and found != own:
        return f"{found} is listed, {own} is in it"
    with tempfile.TemporaryDirectory() as temporary:
        copy = pathlib.Path(temporary) / "copy.mcap"
        subprocess.run([kilvo, "convert", str(folder), str(copy), "--quiet"], check=True)
        read = listed(kilvo, copy)
    return "" if read == found and sum(found.values()) > 0 else f"{found} is listed, {read} was read"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--kilvo", required=True)
    args = parser.parse_args()
    if not args.folder.is_dir():
        return SKIPPED
    folders = sorted({file.parent for ending in ("*.mcap", "*.db3") for file in args.folder.rglob(ending)})
    faults = {folder: fault for folder in folders if (fault := fault_of(args.kilvo, folder))}
    for folder, fault in faults.items():
        print(f"{folder}: {fault}")
    print(f"{len(folders)} recordings, {len(faults)} not read as they say themselves")
    return 0 if folders and not faults else 1


if __name__ == "__main__":
    sys.exit(main())
