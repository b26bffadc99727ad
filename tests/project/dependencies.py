"""Holds three things together: what the sources include, what scripts/install_dependencies installs, docs/dependencies.md.

Every header in <> (and every Python module) that is not the language's own must belong to a package of the list, every
library of the list must be included somewhere, and the document must have a full row, with the version, for each package. (A package that
Debian replaces by a newer version every few weeks has the version "any".)
"""
import argparse
import glob
import importlib.util
import os
import re
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
import cpp_text  # noqa: E402  (from scripts/)

# These come with g++ and python3.
LANGUAGE = re.compile(r"libstdc\+\+-\d+-dev|libgcc-\d+-dev|libc6-dev|linux-libc-dev|(lib)?python3[.\d]*(-minimal|-stdlib)?")
HEADER_FOLDERS = [*sorted(glob.glob("/usr/include/c++/*"), reverse=True), *sorted(glob.glob("/usr/lib/gcc/*/*/include"), reverse=True),
                  *glob.glob("/usr/include/*-linux-gnu"), "/usr/include", "/usr/include/eigen3"]
SKIPPED = 77
# Compiled in a workspace of ROS 2, which Debian does not have.
NOT_DEBIAN = "apps/ros2/"


def packages(root: str, *options: str) -> list[str]:
    return subprocess.run([os.path.join(root, "scripts/install_dependencies"), *options, "--list"],
                          check=True, capture_output=True, text=True).stdout.split()


def owners(paths: list[str]) -> dict[str, str]:
    """The package that each of `paths` belongs to."""
    found = subprocess.run(["dpkg", "-S", *paths], capture_output=True, text=True).stdout if paths else ""
    table = {}
    for line in found.splitlines():
        package, _, path = line.partition(": ")
        table[path] = package.split(":")[0]
    return table


def headers(root: str) -> dict[str, str]:
    """Each header included in <> that is no file of the project, and one place that includes it."""
    places = {}
    generated = {os.path.basename(path).removesuffix(".idl") + ".h" for path in glob.glob(os.path.join(root, "apps/**/*.idl"), recursive=True)}
    for path in cpp_text.sources(root):
        if path.startswith(NOT_DEBIAN):
            continue
        text = cpp_text.without_comments(cpp_text.read(root, path), keep_strings=True)
        for match in re.finditer(r"^[ \t]*#[ \t]*include[ \t]*<([^>\n]+)>", text, re.M):
            if not os.path.exists(os.path.join(root, match[1])) and match[1] not in generated:
                places.setdefault(match[1], f"{path}:{text.count(chr(10), 0, match.start()) + 1}")
    return places


def python_modules(root: str) -> dict[str, str]:
    """Each Python module imported that is neither the language's nor the project's, and one place that imports it."""
    files = [path for pattern in ("scripts/*", "tests/**/*.py", "bench/**/*.py", "lab/**/*.py")
             for path in glob.glob(os.path.join(root, pattern), recursive=True) if os.path.isfile(path)]
    own = {os.path.basename(path).removesuffix(".py") for path in files}
    places = {}
    for path in files:
        with open(path, encoding="utf-8") as file:
            text = file.read()
        if path.endswith(".py") or re.match("#!.*python", text):
            for match in re.finditer(r"^\s*(?:import|from)\s+(\w+)(?:\s*$|\s+as\b|\s+import\b|\.)", text, re.M):
                if match[1] not in sys.stdlib_module_names and match[1] not in own:
                    places.setdefault(match[1], f"{os.path.relpath(path, root)}:{text.count(chr(10), 0, match.start()) + 1}")
    return places


def find_header(header: str) -> str | None:
    return next((path for folder in HEADER_FOLDERS if os.path.exists(path := os.path.join(folder, header))), None)


def find_module(module: str) -> str | None:
    spec = importlib.util.find_spec(module)
    return spec.origin if spec else None


def check_sources(root: str, listed: list[str]) -> list[str]:
    faults = []
    used = set()
    wanted = [(f"<{name}>", place, find_header(name)) for name, place in headers(root).items()]
    wanted += [(f"module {name}", place, find_module(name)) for name, place in python_modules(root).items()]
    owner_of = owners(sorted({path for _, _, path in wanted if path}))
    for name, place, path in wanted:
        package = owner_of.get(path or "")
        used.add(package)
        if package is None:
            faults.append(f"{place}: {name} is in no installed package")
        elif package not in listed and not LANGUAGE.fullmatch(package):
            faults.append(f"{place}: {name} is in {package}, which scripts/install_dependencies does not install")
    faults += [f"scripts/install_dependencies: nothing in the tree includes a header of {package}; leave it out"
               for package in listed if package.endswith("-dev") and package not in {*used, "dpkg-dev"} and not package.startswith("libclang-rt")]
    return faults


def check_document(root: str, listed: list[str]) -> list[str]:
    faults = []
    with open(os.path.join(root, "docs/dependencies.md"), encoding="utf-8") as file:
        rows = {cells[0].strip("`"): cells for line in file if line.startswith("| `")
                for cells in [[cell.strip() for cell in line.strip().strip("|").split("|")]]}
    status = subprocess.run(["dpkg-query", "-W", "-f", "${Package} ${Version}\n", *listed], capture_output=True, text=True).stdout
    versions = dict(line.split() for line in status.splitlines())
    for package in listed:
        row = rows.pop(package, None)
        if row is None:
            faults.append(f"docs/dependencies.md: no row for {package}")
        elif len(row) != 5 or not all(row):
            faults.append(f"docs/dependencies.md: the row of {package} must say version, where it is used, why, and the licence")
        elif row[1] != "any" and package in versions and not re.match(re.escape(row[1]) + r"(?![\d.])", versions[package].split(":")[-1]):
            faults.append(f"docs/dependencies.md: {package} is {versions[package]} here, the row says {row[1]}")
    faults += [f"docs/dependencies.md: {package} has a row but scripts/install_dependencies does not install it" for package in rows]
    return faults


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=ROOT, help="the tree to check")
    root = parser.parse_args().root
    if not shutil.which("dpkg"):
        print("dependencies: skipped, this is no Debian system")
        return SKIPPED
    faults = check_sources(root, packages(root)) + check_document(root, packages(root, "--dev"))
    print("\n".join(faults + [f"dependencies: {len(faults)} faults"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
