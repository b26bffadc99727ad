"""Installs a build into a temporary folder, moves it elsewhere, and builds and runs tests/consumer against it."""
import argparse
import glob
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))


def run(*command: str) -> str:
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}\nconsumer: the command above failed with {done.returncode}")
    return done.stdout


def check_installed(prefix: str) -> list[str]:
    headers = [os.path.relpath(path, os.path.join(prefix, "include"))
               for path in glob.glob(os.path.join(prefix, "include/**/*.*"), recursive=True)]
    faults = [f"{header} is installed, only headers of kilvo/, and of the components, should be" for header in headers
              if not header.startswith(("kilvo/", "kilvo-live/")) or not header.endswith(".hpp")]
    faults += [f"{header} is not installed" for header in
               (os.path.relpath(path, ROOT) for path in glob.glob(os.path.join(ROOT, "kilvo/*/*.hpp"))) if header not in headers]
    for path in glob.glob(os.path.join(prefix, "**/*.cmake"), recursive=True):
        with open(path, encoding="utf-8") as file:
            if ROOT in file.read():
                faults.append(f"{path} names the source folder: the package cannot be moved to another machine")
    return faults


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, help="a finished build folder of KILVO")
    parser.add_argument("--settings", nargs="*", default=[], help="NAME=VALUE for the consumer's own CMake")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        prefix = os.path.join(folder, "elsewhere")
        run("cmake", "--install", options.build, "--prefix", os.path.join(folder, "made"))
        os.rename(os.path.join(folder, "made"), prefix)
        faults = check_installed(prefix)
        build = os.path.join(folder, "build")
        run("cmake", "-S", HERE, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}", *[f"-D{setting}" for setting in options.settings])
        run("cmake", "--build", build)
        print(run(os.path.join(build, "consumer")), end="")
        if os.path.exists(live := os.path.join(build, "live_consumer")):
            print(run(live, os.path.join(prefix, "share/kilvo/config/robots/sim.yaml")), end="")
    for fault in faults:
        print(fault)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
