"""The type hashes of ROS 2 (REP 2011, RIHS01) of the messages in an IDL file: SHA-256 over the JSON of their description.

    type_hashes.py ros2.idl                 prints "package/Name RIHS01_..." for each struct
    type_hashes.py ros2.idl --table FILE    compares with the lines {"package/Name", "hash", ...} of a C++ source; 1 if any differs"""
import argparse
import hashlib
import json
import re
import sys

# rosidl's FieldType of each name in IDL; an array is 48 more, a sequence 144 more.
NESTED, ARRAY, SEQUENCE = 1, 48, 144
KINDS = {"int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9, "float": 10, "double": 11, "boolean": 15,
         "octet": 16, "string": 17}


def plain(name: str) -> str:
    """pkg::msg::dds_::Name_ -> pkg/msg/Name"""
    package, kind, _, last = name.split("::")
    return f"{package}/{kind}/{last[:-1]}"


def read(path: str) -> dict[str, list]:
    """Full name in IDL -> (name of the field, name of its type, array size or None, is a sequence)."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"//.*", "", file.read())
    structs, package = {}, ""
    for match in re.finditer(r"module (\w+) \{ module (msg|srv) \{|struct (\w+) \{(.*?)\};", text, re.S):
        if match[1]:
            package = f"{match[1]}::{match[2]}::dds_"
            continue
        fields = []
        for kind, element, name, size in re.findall(r"(sequence<([\w:]+)>|[\w:]+) (\w+)(?:\[(\d+)\])?;", match[4]):
            fields.append((name, element or kind, int(size) if size else None, bool(element)))
        structs[f"{package}::{match[3]}"] = [(n, t if t in KINDS or "::" in t else f"{package}::{t}", s, q) for n, t, s, q in fields]
    return structs


def described(name: str, structs: dict) -> dict:
    fields = []
    for field, kind, size, is_sequence in structs[name]:
        code = KINDS.get(kind, NESTED) + (ARRAY if size else SEQUENCE if is_sequence else 0)
        fields.append({"name": field, "type": {"type_id": code, "capacity": size or 0, "string_capacity": 0,
                                               "nested_type_name": "" if kind in KINDS else plain(kind)}})
    return {"type_name": plain(name), "fields": fields}


def within(name: str, structs: dict) -> set:
    nested = {kind for _, kind, _, _ in structs[name] if kind not in KINDS}
    return nested.union(*(within(kind, structs) for kind in nested))


def hash_of(name: str, structs: dict) -> str:
    whole = {"type_description": described(name, structs),
             "referenced_type_descriptions": [described(other, structs) for other in sorted(within(name, structs), key=plain)]}
    return hashlib.sha256(json.dumps(whole).encode("utf-8")).hexdigest()


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("idl")
    parser.add_argument("--table")
    arguments = parser.parse_args()
    structs = read(arguments.idl)
    hashes = {plain(name).replace("/msg/", "/"): hash_of(name, structs) for name in structs}
    if not arguments.table:
        for name, value in hashes.items():
            print(name, "RIHS01_" + value)
        return 0
    with open(arguments.table, encoding="utf-8") as file:
        table = re.findall(r'\{"([\w/]+)",\s*"([0-9a-f]{64})"', file.read())
    wrong = [f"{name}: the table has {value}, its description gives {hashes.get(name)}" for name, value in table if hashes.get(name) != value]
    print("\n".join(wrong) or f"type_hashes: {len(table)} hashes, all as described")
    return 1 if wrong or len(table) < 10 else 0


if __name__ == "__main__":
    sys.exit(main())
