"""Holds the documents to the tree: links lead somewhere, what stands in backticks exists, every module is named in docs/architecture.md.

In docs/architecture.md and docs/notation.md a word in backticks must be a file or folder of the project or a word of its sources
(`kilvo::x`, `x.y`, `f(a)` and the like are taken apart; `_W` and the like are endings of names)."""
import argparse
import glob
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
import cpp_text  # noqa: E402  (from scripts/)

NAMING = ("docs/architecture.md", "docs/notation.md")
# Named as a shape, an example or something that is not there on purpose.
EXAMPLES = {"x.hpp", "x.cpp", "x_test.cpp", "x_fuzz.cpp", "now", "-ffast-math", "p_W", "p_I", "p_A", "p_B", "T_AB", "T_WL", "T_IL", "T_WI"}


def words_of_the_tree(root: str) -> set[str]:
    words = set()
    files = [os.path.join(root, path) for path in cpp_text.sources(root)]
    files += glob.glob(os.path.join(root, "**/CMakeLists.txt"), recursive=True) + glob.glob(os.path.join(root, "config/**/*.yaml"), recursive=True)
    for path in files:
        with open(path, encoding="utf-8") as file:
            words |= set(re.findall(r"\w+", file.read()))
    return words


def without_blocks(text: str) -> str:
    """`text` without its fenced blocks, and with what stands in backticks still in its line."""
    return re.sub(r"^```.*?^```$", lambda block: re.sub(r"[^\n]", "", block.group()), text, flags=re.M | re.S)


def check(root: str) -> list[str]:
    faults = []
    words = words_of_the_tree(root)
    endings = {f"_{ending}" for word in words for ending in [word.rpartition("_")[2]] if "_" in word}
    for path in sorted(glob.glob(os.path.join(root, "docs/**/*.md"), recursive=True)):
        name = os.path.relpath(path, root)
        with open(path, encoding="utf-8") as file:
            text = file.read()
        for number, line in enumerate(without_blocks(text).splitlines(), 1):
            for link in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", line):
                if not os.path.exists(os.path.join(os.path.dirname(path), link)):
                    faults.append(f"{name}:{number}: {link} does not exist")
            for code in re.findall(r"`([^`]+)`", line) if name in NAMING else []:
                if code in EXAMPLES or code in endings or glob.glob(os.path.join(root, code)) or glob.glob(os.path.join(root, "*", code)):
                    continue
                for word in re.findall(r"[A-Za-z]\w+", code):
                    if word not in words and word not in EXAMPLES and not glob.glob(os.path.join(root, "*", word)):
                        faults.append(f"{name}:{number}: there is no {word} (`{code}`)")

    with open(os.path.join(root, "docs/architecture.md"), encoding="utf-8") as file:
        page = file.read()
    with open(os.path.join(root, "modules.txt"), encoding="utf-8") as file:
        for module in re.findall(r"^(?!reserve|test-only)([\w/]+):", file.read(), re.M):
            if not re.search(rf"(?<!\w){module.split('/')[-1]}/", page):
                faults.append(f"docs/architecture.md: the module {module} is not on the page")
    return faults


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=ROOT, help="the project")
    faults = check(parser.parse_args().root)
    print("\n".join(faults + [f"documents: {len(faults)} faults"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
