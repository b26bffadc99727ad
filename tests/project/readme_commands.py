"""Holds README.md and the pages of docs/ to the truth: every command line, option and piece of code in them is run or looked up.

Fenced blocks, by what follows the three backticks:
  sh                  each `kilvo ...` line is run and must succeed: those of a page one after the other in one folder, empty at first
  sh needs-recording  it cannot be run here: its verb and each of its options must be in `kilvo VERB --help`
  yaml FILE           is written into that folder as FILE, for the commands below it; `kilvo config check FILE` must find it good
  yaml                each key must be one that config/robots/g1.yaml or docs/parameters.md has
  cmake, cpp          each line must stand, in this order, in tests/consumer/CMakeLists.txt or tests/consumer/main.cpp
  text                nothing is checked
In both kinds of sh block: `make X` needs a target X (and uses of VAR=... a variable VAR) in the Makefile, a path of the project
must exist, and any other program must be one of PROGRAMS. A trailing `# ...` is a comment. Links to files must lead somewhere. README.md
has at most LINES lines.
"""
import argparse
import glob
import os
import re
import shlex
import subprocess
import sys
import tempfile
from typing import Iterator, NamedTuple

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PROGRAMS = ("cd", "git", "cmake", "ctest")
TIMEOUT_S = 120
LINES = 150


class Block(NamedTuple):
    kind: str  # what follows the backticks
    line: int  # of its first line
    lines: list[str]


def blocks(text: str) -> Iterator[Block]:
    for match in re.finditer(r"^```([^\n]*)\n(.*?)^```$", text, re.M | re.S):
        yield Block(match[1].strip(), text.count("\n", 0, match.start(2)) + 1, match[2].splitlines())


def commands(block: Block) -> Iterator[tuple[int, list[str]]]:
    """The commands of a block, split into words, lines that end in a backslash joined."""
    start, text = 0, ""
    for number, line in enumerate(block.lines, block.line):
        start = start if text else number
        text += line.rstrip().removesuffix("\\")
        if not line.rstrip().endswith("\\"):
            for part in re.split(r"\s(?:&&|;)\s", text):
                words = shlex.split(part, comments=True)
                if words:
                    yield start, words
            text = ""


class Page:
    def __init__(self, root: str, kilvo: str | None, path: str = "README.md"):
        self.root = root
        self.kilvo = kilvo
        self.path = path
        self.folder = ""  # where the commands are run
        self.faults: list[str] = []
        self.checked = 0
        self.helps: dict[tuple[str, ...], str | None] = {}
        self.text = re.sub(r"<!--.*?-->", lambda comment: re.sub(r"[^\n]", "", comment.group()), self.read(path), flags=re.S)
        makefile = self.read("Makefile")
        self.targets = set(" ".join(re.findall(r"^([\w\- ]+):(?!=)", makefile, re.M)).split())
        self.variables = set(re.findall(r"\$\((\w+)\)|^(?:ifdef\s+)?(\w+)\s*(?:[?:]?=|$)", makefile, re.M))
        self.variables = {name for pair in self.variables for name in pair if name}

    def read(self, path: str) -> str:
        with open(os.path.join(self.root, path), encoding="utf-8") as file:
            return file.read()

    def fault(self, line: int, text: str) -> None:
        self.faults.append(f"{self.path}:{line}: {text}")

    def check(self) -> list[str]:
        if self.path == "README.md" and self.text.count("\n") > LINES:
            self.fault(LINES + 1, f"a first page of more than {LINES} lines")
        with tempfile.TemporaryDirectory() as self.folder:
            self.check_blocks()
        for match in re.finditer(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", self.text):
            if not os.path.exists(os.path.join(self.root, os.path.dirname(self.path), match[1])):
                self.fault(self.text.count("\n", 0, match.start()) + 1, f"{match[1]} does not exist")
        return self.faults

    def check_blocks(self) -> None:
        for block in blocks(self.text):
            kind, _, marker = block.kind.partition(" ")
            if kind == "sh" and marker in ("", "needs-recording"):
                for line, words in commands(block):
                    self.checked += 1
                    self.check_command(line, words, marker)
            elif kind in ("cmake", "cpp"):
                self.check_code(block, "tests/consumer/CMakeLists.txt" if kind == "cmake" else "tests/consumer/main.cpp")
            elif kind == "yaml" and marker:
                self.check_configuration(block, marker)
            elif kind == "yaml":
                self.check_keys(block)
            elif kind != "text":
                self.fault(block.line - 1, f"a block of kind `{block.kind}`, which is none of those that are checked")

    def check_command(self, line: int, words: list[str], marker: str) -> None:
        program = words[0]
        if os.path.basename(program) == "kilvo":
            self.check_kilvo(line, words[1:], marker)
        elif program == "make":
            for word in words[1:]:
                name = word.split("=")[0]
                if name not in (self.variables if "=" in word else self.targets):
                    self.fault(line, f"the Makefile has no {'variable' if '=' in word else 'target'} {name}")
        elif "/" in program:
            if not os.access(os.path.join(self.root, program), os.X_OK):
                self.fault(line, f"{program} is no program of the project")
        elif program not in PROGRAMS:
            self.fault(line, f"{program} is a program that this check does not know")

    def check_kilvo(self, line: int, words: list[str], marker: str) -> None:
        for word in words:
            if word.startswith("config/") and not os.path.exists(os.path.join(self.root, word)):
                self.fault(line, f"{word} does not exist")
        if not self.kilvo:
            return
        if marker == "needs-recording":
            self.look_up(line, words)
            return
        words = [os.path.join(self.root, word) if word.startswith("config/") else word for word in words]
        done = subprocess.run([self.kilvo, *words], cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=TIMEOUT_S)
        if done.returncode:
            self.fault(line, f"`kilvo {' '.join(words)}` ends with {done.returncode}: {done.stderr.strip()[-300:]}")

    def look_up(self, line: int, words: list[str]) -> None:
        """The verb (and the verb under it) must exist, and its help must name each option."""
        verb = words[:1]
        page = self.help_of(verb)
        if page is None:
            self.fault(line, f"there is no `kilvo {' '.join(verb)}`")
            return
        if len(words) > 1 and re.search(rf"^\s+{re.escape(words[1])}(\s|$)", page, re.M) and self.help_of(words[:2]) is not None:
            page += self.help_of(words[:2])
        for option in (word.split("=")[0] for word in words if word.startswith("-")):
            if not re.search(rf"(?<![\w-]){re.escape(option)}(?![\w-])", page):
                self.fault(line, f"`kilvo {' '.join(verb)}` has no option {option}")

    def help_of(self, verb: list[str]) -> str | None:
        """What `kilvo VERB --help` prints; nothing when there is no such verb."""
        if tuple(verb) not in self.helps:
            done = subprocess.run([self.kilvo, *verb, "--help"], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=TIMEOUT_S)
            self.helps[tuple(verb)] = done.stdout if done.returncode == 0 and done.stdout else None
        return self.helps[tuple(verb)]

    def check_code(self, block: Block, path: str) -> None:
        rest = [line.strip() for line in self.read(path).splitlines()]
        for number, line in enumerate(block.lines, block.line):
            if line.strip() and line.strip() != "...":
                if line.strip() not in rest:
                    self.fault(number, f"`{line.strip()}` is not, in this order, in {path}")
                    return
                rest = rest[rest.index(line.strip()) + 1:]

    def check_configuration(self, block: Block, name: str) -> None:
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            file.write("\n".join(block.lines) + "\n")
        if self.kilvo:
            self.check_kilvo(block.line, ["config", "check", name], "")

    def check_keys(self, block: Block) -> None:
        if not os.path.exists(os.path.join(self.root, "config/robots/g1.yaml")):
            self.fault(block.line, "there is no config/robots/g1.yaml to hold this against")
            return
        known = {"q", "rpy", *re.findall(r"([\w-]+):", re.sub(r"#.*", "", self.read("config/robots/g1.yaml")))}
        if os.path.exists(os.path.join(self.root, "docs/parameters.md")):
            known |= {word for key in re.findall(r"^\| `([\w.]+)`", self.read("docs/parameters.md"), re.M) for word in key.split(".")}
        for number, line in enumerate(block.lines, block.line):
            for key in re.findall(r"([\w-]+):(?=\s|$)", re.sub(r"#.*", "", line)):
                if key not in known:
                    self.fault(number, f"{key}: is no key of config/robots/g1.yaml or docs/parameters.md")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=ROOT, help="the project")
    parser.add_argument("--kilvo", help="the program; without it verbs and options are not looked up")
    options = parser.parse_args()
    paths = ["README.md", *sorted(glob.glob("docs/*.md", root_dir=options.root))]
    pages = [Page(options.root, options.kilvo, path) for path in paths]
    faults = [fault for page in pages for fault in page.check()]
    checked = sum(page.checked for page in pages)
    print("\n".join(faults + [f"readme: {checked} commands on {len(pages)} pages, {len(faults)} faults" + ("" if options.kilvo else "; no program to ask")]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
