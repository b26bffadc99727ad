"""Reads C++ source well enough for the checks of this folder: no comments or strings in the way, and which brace opens what."""
import hashlib
import json
import os
import re
from typing import Iterator, NamedTuple

FLOORS = ("kilvo", "lab", "apps", "tests", "bench")
TEST_SUFFIXES = ("_test.cpp", "_fuzz.cpp")


def sources(root: str) -> Iterator[str]:
    """Every *.hpp and *.cpp of the project as a path relative to `root`, sorted."""
    for floor in FLOORS:
        for folder, folders, files in os.walk(os.path.join(root, floor)):
            folders.sort()
            for name in sorted(files):
                if name.endswith((".hpp", ".cpp")):
                    yield os.path.relpath(os.path.join(folder, name), root)


def is_test(path: str) -> bool:
    return path.endswith(TEST_SUFFIXES) or path.startswith("tests/")


def read(root: str, path: str) -> str:
    with open(os.path.join(root, path), encoding="utf-8") as file:
        return file.read()


def project_files(root: str, path: str, seen: set[str] | None = None) -> set[str]:
    """`path` and every header of the project that it includes, directly or not."""
    seen = set() if seen is None else seen
    if path not in seen and os.path.isfile(os.path.join(root, path)):
        seen.add(path)
        for header in re.findall(r'^\s*#\s*include\s*"([^"]+)"', read(root, path), re.M):
            project_files(root, header, seen)
    return seen


def fingerprint(root: str, path: str, others: list[str], command: str) -> str:
    """Of a source with all that it includes, of `others` and of how it is compiled."""
    digest = hashlib.sha256(command.encode())
    for name in [*others, *sorted(project_files(root, path))]:
        digest.update(read(root, name).encode())
    return digest.hexdigest()


def compile_commands(build: str) -> list[dict[str, str]]:
    """compile_commands.json as if each source were compiled alone, with its headers read from source: no units, nothing precompiled."""
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        entries = json.load(file)
    alone = []
    for entry in entries:
        command = re.sub(r" -Winvalid-pch| -include \S*cmake_pch\.hxx", "", entry["command"])
        sources = [entry["file"]]
        if re.search(r"/Unity/unity_\d+_cxx\.cxx$", entry["file"]):
            with open(entry["file"], encoding="utf-8") as file:
                sources = re.findall(r'^#include "(.+)"$', file.read(), flags=re.M)
        for source in sources:
            alone.append({**entry, "file": source, "command": command.replace(f"-c {entry['file']}", f"-c {source}")})
    return alone


_LEXEME = re.compile(
    r"""(?P<line>//(?:\\\n|[^\n])*)
      | (?P<block>/\*.*?\*/)
      | (?P<raw>R"(?P<tag>[^()\\\s]{0,16})\(.*?\)(?P=tag)")
      | (?P<string>"(?:\\.|[^"\\\n])*")
      | (?P<number>\b\d(?:'?[\w.])*)
      | (?P<char>'(?:\\.|[^'\\\n])+')""",
    re.X | re.S)


def without_comments(text: str, keep_strings: bool = False) -> str:
    """`text` with comments blanked (and, unless `keep_strings`, the inside of strings); every line keeps its number."""

    def blank(match: re.Match) -> str:
        lexeme = match.group()
        if match["number"] or (keep_strings and not (match["line"] or match["block"])):
            return lexeme
        hole = re.sub(r"[^\n]", " ", lexeme)
        return hole if match["line"] or match["block"] else '"' + hole[1:-1] + '"'

    return _LEXEME.sub(blank, text)


class Scope(NamedTuple):
    kind: str   # namespace, type, function
    head: str   # what stands before the brace, on one line
    first: int  # line on which the head begins
    last: int   # line of the closing brace


class Statement(NamedTuple):
    scope: str  # kind of the scope around it: namespace, type or function
    text: str
    line: int


_VALUE = "\x02"  # stands for a braced value once it is closed


def _without_preprocessor(text: str) -> str:
    return re.sub(r"^[ \t]*#(?:\\\n|[^\n])*", lambda m: re.sub(r"[^\n]", " ", m.group()), text, flags=re.M)


def _flat(head: str) -> str:
    """`head` on one line: no template arguments, no operator symbols, every bracket and braced value written ()."""
    head = re.sub(r"\boperator\s*(\(\s*\)|[^\s\w(]+)", "operator_ ", " ".join(head.split())).replace(_VALUE, "()")
    before = None
    while before != head:
        before = head
        head = re.sub(r"\((?:[^()]|\(\))+\)", "()", re.sub(r"<(?:[^<>()]|\(\))*>", "", head))
    return head.strip()


def _opens(head: str) -> str:
    """What a brace after `head` opens in a namespace or a type: namespace, type, function or value."""
    flat = _flat(head)
    if re.search(r"\bnamespace\b[\w:\s]*$|\bextern\s*\"\s*\"$", flat):
        return "namespace"
    if re.search(r"\b(class|struct|union|enum)\b", flat) and not re.search(r"\w\s*\(\)$", re.sub(r"alignas\s*\(\)", "", flat)):
        return "type"
    if "=" in flat or "()" not in flat:
        return "value"
    after = flat[flat.rindex("()") + 2:].replace("::", "")
    if re.search(r"[:,]\s*\w+$", after) and "->" not in after:
        return "value"  # a member initialiser: T() : a_{1} {
    return "function"


def scan(text: str) -> Iterator[Scope | Statement]:
    """The scopes of `text`, each as it closes, and the statements that stand in a namespace, a type or a function."""
    text = _without_preprocessor(without_comments(text))
    stack: list[tuple[str, str, int, int]] = []  # kind, and what to go back to: head, its first line, open brackets
    head, first, brackets, line = "", 0, 0, 1

    def here() -> str:
        return stack[-1][0] if stack else "namespace"

    for char in text:
        line += char == "\n"
        if not head.strip() and not char.isspace():
            first = line
        if char == "{":
            if here() in ("function", "value"):
                kind = here()  # whatever it is, it belongs to the function or value around it
            else:
                kind = "value" if brackets else _opens(head)
            nested = kind == here() and kind == "function"
            stack.append((kind, "" if nested else head, 0 if nested else first, brackets))
            head, brackets = "", 0
        elif char == "}" and stack:
            kind, old_head, old_first, brackets = stack.pop()
            head = ""
            if kind == "value":
                head, first = old_head + _VALUE, old_first
            elif old_first:
                yield Scope(kind, " ".join(old_head.split()), old_first, line)
        elif char == ";" and (not brackets or here() == "function"):
            if here() != "value":
                yield Statement(here(), " ".join(head.replace(_VALUE, "{}").split()), first)
                head = ""
        elif char == ":" and head.strip() in ("public", "protected", "private"):
            head = ""
        else:
            brackets += (char in "([") - (char in ")]")
            head += char


class Class(NamedTuple):
    name: str
    line: int
    data: int               # data members that are no constants
    private_functions: int


_CLASS = re.compile(r"\bclass\s+(?:alignas\s*\([^)]*\)\s*)?(\w[\w:]*)[^;{}()]*\{")


def _closing(text: str, opening: int) -> int:
    """Where the brace at `opening` is closed."""
    depth = 0
    for i in range(opening, len(text)):
        depth += (text[i] == "{") - (text[i] == "}")
        if depth == 0:
            return i
    return len(text)


def _members(body: str) -> Iterator[tuple[str, str, bool]]:
    """Access, text and whether it is a function, of each member of a class; a braced value is written {}, a nested type by its head."""
    access, head, i, brackets = "private", "", 0, 0
    while i < len(body):
        char = body[i]
        brackets += (char in "([") - (char in ")]")
        if char == "{" and not brackets:
            kind, i = _opens(head), _closing(body, i)
            if kind == "function":
                yield access, head.strip(), True
            head = "" if kind == "function" else head + (_VALUE if kind == "value" else "{}")
        elif char == "{":
            i = _closing(body, i)
        elif char == ";" and not brackets:
            if head.strip():
                yield access, head.strip(), "()" in _flat(head.replace(_VALUE, "")).split("=")[0]
            head = ""
        elif char == ":" and head.strip() in ("public", "protected", "private"):
            access, head = head.strip(), ""
        else:
            head += char
        i += 1


def classes(text: str) -> Iterator[Class]:
    """What each class (no struct: that is data by design) of `text` holds."""
    text = _without_preprocessor(without_comments(text))
    for match in _CLASS.finditer(text):
        if re.search(r"\benum\s+$", text[:match.start()]):
            continue
        data = functions = 0
        for access, member, is_function in _members(text[match.end():_closing(text, match.end() - 1)]):
            if re.match(r"(?:using|friend|typedef|static_assert)\b", member):
                continue
            if is_function:
                functions += access == "private"
            elif not re.match(r"(?:template\b|(?:inline\s+)?(?:static|constexpr)\b)", member):
                is_type = re.match(r"(?:class|struct|union|enum)\b", member)
                declared = member.rpartition("{}")[2] if is_type and "{}" in member else "" if is_type else member
                data += _flat(declared).count(",") + 1 if declared.strip() else 0
        yield Class(match[1], text.count("\n", 0, match.start()) + 1, data, functions)
