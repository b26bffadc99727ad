"""tests/project/readme_commands.py on small READMEs, each with one untruth in it, and a stand-in for the program."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))

MAKEFILE = """BUILD := build
PREFIX ?= /usr
demo install: build
\tkilvo demo
test: build
ifdef RECORDINGS
endif
"""
# Knows `run INPUT --out DIR`, `config show`, and nothing else.
KILVO = """#!/bin/bash
case "$*" in
  --help|"run --help") echo '  run   INPUT --out DIR  --set KEY=VALUE' ;;
  "config --help") echo '  show  print' ;;
  "config show --help") echo '  --all  everything' ;;
  "config show"|"config show --all") exit 0 ;;
  *) echo "not known: $*" >&2; exit 2 ;;
esac
"""


class ReadmeCommands(unittest.TestCase):
    def setUp(self):
        self.root = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.root)
        self.write("Makefile", MAKEFILE)
        self.write("kilvo", KILVO)
        self.write("config/robot.yaml", "")
        self.write("config/robots/g1.yaml", "imu: {topic: /imu, rate: 200}  # comment: none\n")
        self.write("tests/consumer/main.cpp", "int main() {\n  go();\n  stop();\n}\n")
        self.write("tests/consumer/CMakeLists.txt", "find_package(kilvo 0.1)\n")

    def write(self, path: str, text: str) -> None:
        path = os.path.join(self.root, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(path, 0o755)

    def check(self, readme: str, program: bool = True) -> tuple[int, str]:
        self.write("README.md", readme)
        command = [sys.executable, os.path.join(HERE, "readme_commands.py"), "--root", self.root]
        done = subprocess.run(command + (["--kilvo", os.path.join(self.root, "kilvo")] if program else []), capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        return done.returncode, done.stdout

    def assert_true(self, readme: str, **options) -> None:
        code, output = self.check(readme, **options)
        self.assertEqual(code, 0, output)

    def assert_untrue(self, readme: str, message: str) -> None:
        code, output = self.check(readme)
        self.assertEqual(code, 1, output)
        self.assertIn(message, output)

    def test_true_commands(self):
        self.assert_true("```sh\nmake demo  # first\nmake install PREFIX=x && make test RECORDINGS=y\nkilvo config show\ncd build\n```\n")
        self.assert_true("```sh needs-recording\nkilvo run walk.bag --out out \\\n  --set a=1\nkilvo config show --all\n```\n")

    def test_command_that_fails(self):
        self.assert_untrue("\n```sh\nkilvo config check x.yaml\n```\n", "README.md:3: `kilvo config check x.yaml` ends with 2: not known")

    def test_verb_that_does_not_exist(self):
        self.assert_untrue("```sh needs-recording\nkilvo fly walk.bag\n```\n", "README.md:2: there is no `kilvo fly`")

    def test_option_that_does_not_exist(self):
        self.assert_untrue("```sh needs-recording\n# so:\nkilvo run walk.bag --output x\n```\n", "README.md:3: `kilvo run` has no option --output")
        self.assert_untrue("```sh needs-recording\nkilvo run walk.bag --o x\n```\n", "`kilvo run` has no option --o")

    def test_without_the_program_its_verbs_are_not_looked_up(self):
        self.assert_true("```sh needs-recording\nkilvo fly walk.bag\n```\n", program=False)

    def test_configuration_that_does_not_exist(self):
        self.assert_true("```sh needs-recording\nkilvo run config/robot.yaml\n```\n")
        self.assert_untrue("```sh needs-recording\nkilvo run config/other.yaml\n```\n", "README.md:2: config/other.yaml does not exist")

    def test_make_target_that_does_not_exist(self):
        self.assert_untrue("```sh\nmake coffee\n```\n", "README.md:2: the Makefile has no target coffee")
        self.assert_untrue("```sh\nmake demo MILK=1\n```\n", "README.md:2: the Makefile has no variable MILK")

    def test_program_that_does_not_exist(self):
        self.assert_untrue("```sh\nscripts/nothing\n```\n", "scripts/nothing is no program of the project")
        self.assert_untrue("```sh\nsudo reboot\n```\n", "sudo is a program that this check does not know")

    def test_code_that_nobody_compiles(self):
        self.assert_true("```cpp\ngo();\n...\nstop();\n```\n```cmake\nfind_package(kilvo 0.1)\n```\n")
        self.assert_untrue("```cpp\nstop();\ngo();\n```\n", "README.md:3: `go();` is not, in this order, in tests/consumer/main.cpp")
        self.assert_untrue("```cmake\nfind_package(kilvo 9)\n```\n", "is not, in this order, in tests/consumer/CMakeLists.txt")

    def test_key_that_no_configuration_has(self):
        self.assert_true("```yaml\nimu:\n  rate: 100  # so: fast\n```\n")
        self.assert_untrue("```yaml\nimu: {speed: 100}\n```\n", "README.md:2: speed: is no key of config/robots/g1.yaml or docs/parameters.md")

    def test_block_that_nobody_checks(self):
        self.assert_untrue("```bash\nkilvo run\n```\n", "README.md:1: a block of kind `bash`")
        self.assert_untrue("```\nkilvo run\n```\n", "README.md:1: a block of kind ``")
        self.assert_true("```text\nkilvo fly\n```\n")

    def test_link_that_leads_nowhere(self):
        self.assert_true("[so](config/robot.yaml) and [there](https://example.org) and [below](#below)\n")
        self.assert_untrue("\n[so](docs/so.md)\n", "README.md:2: docs/so.md does not exist")


if __name__ == "__main__":
    unittest.main()
