"""Holds documents, public names, comments and messages to the glossary of docs/notation.md: the words that it replaces are not used.

Checked: README.md, CHANGELOG.md's unreleased part, docs/, and all sources; PRIVATE in README.md, docs/ and kilvo/ without tests."""
import argparse
import glob
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
import cpp_text  # noqa: E402  (from scripts/)

# "room", "wall", "floor" and "door" are things that a robot sees; as parts of a program they come with these words.
OLD = re.compile(r"forerunner|footfall|\bhouse\b|\bpolice\b|\bconductor\b|\bthe desk\b|\bthe doors\b|\brooms\.txt\b|kilvo_room\b|check_rooms|\bthe walls? of the (?:code|project)\b|"
                 r"\bwithout a word\b|\bby its own word\b|\b(?:is|are|was|were|be) said\b|\bspoken of\b|\bLiDAR sense\b", re.I)
# Words of a private language, in documents and in the estimator's comments and messages: the glossary has the field's terms.
PRIVATE = re.compile(r"(?:\bpercent|%) of the way\b|\bmend(?:s|ed|ing)?\b|\baccus(?:e|es|ed|ations?)\b|\bmid-(?:walk|run|sway|swing)\b|\bthrown away\b|"
                     r"\bbeg(?:in|ins|an|un) anew\b|\b(?:tells?|says?|said|told) nothing\b|\bsomebody\b|\bin vain\b|\bstanding f(?:oo|ee)t\b|"
                     r"\bknocks?\b|\b(?:one|two|third|each|every|all|other|wrong) senses?\b|\bstarted? on the move\b", re.I)
GLOSSARY = "docs/notation.md"


def texts(root: str) -> list[tuple[str, str]]:
    files = ["README.md", *glob.glob("docs/**/*.md", root_dir=root, recursive=True), *cpp_text.sources(root)]
    found = [(path, cpp_text.read(root, path)) for path in files if os.path.exists(os.path.join(root, path)) and path != GLOSSARY]
    if os.path.exists(os.path.join(root, "CHANGELOG.md")):
        found.append(("CHANGELOG.md", cpp_text.read(root, "CHANGELOG.md").split("\n## [0")[0]))
    return found


def is_plain(path: str) -> bool:
    """A text that must be free of the private words too."""
    return path.endswith(".md") and path != "CHANGELOG.md" or path.startswith("kilvo/") and not cpp_text.is_test(path)


def check(root: str) -> list[str]:
    return [f"{path}:{number}: `{match[0]}`: see the glossary in {GLOSSARY}"
            for path, text in texts(root) for number, line in enumerate(text.splitlines(), 1)
            for words in ([OLD, PRIVATE] if is_plain(path) else [OLD]) for match in words.finditer(line)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=ROOT, help="the project")
    faults = check(parser.parse_args().root)
    print("\n".join(faults + [f"words: {len(faults)} faults"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
