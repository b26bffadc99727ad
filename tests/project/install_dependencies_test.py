"""scripts/install_dependencies, with stand-ins for dpkg-query and apt-get: when it asks for what, and what it says."""
import os
import shutil
import subprocess
import tempfile
import unittest

from planted_tree import SCRIPTS

SCRIPT = os.path.join(SCRIPTS, "install_dependencies")
TOOLS = ("bash", "sh", "grep", "sed", "id", "env", "mktemp", "rm", "cat", "tee")

# Says that everything is installed but the packages in the file `missing`.
DPKG_QUERY = """#!/bin/bash
for p in "$@"; do case "$p" in -*|*'$'*) ;; *) grep -qxF "$p" "$HERE/missing" || echo "installed $p" ;; esac; done
"""
# Notes its arguments; `install` fails as often as the file `failures` has lines.
APT_GET = """#!/bin/bash
echo "$@" >> "$HERE/calls"
case "$*" in *install*)
  echo 'dlstatus:1:40.1:Retrieving file 1 of 2'; echo 'pmstatus:libpng-dev:100.0:Installed libpng-dev'
  if [ -s "$HERE/failures" ]; then sed -i 1d "$HERE/failures"; echo 'E: Unable to locate package' >&2; exit 100; fi ;;
esac
"""


class InstallDependencies(unittest.TestCase):
    def setUp(self):
        self.here = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.here)
        for tool in TOOLS:
            os.symlink(shutil.which(tool), os.path.join(self.here, tool))
        self.write("dpkg-query", DPKG_QUERY)
        self.write("apt-get", APT_GET)
        self.write("id", "#!/bin/bash\necho 0\n")
        self.write("missing", "")
        self.write("failures", "")

    def write(self, name: str, text: str) -> None:
        path = os.path.join(self.here, name)
        if os.path.islink(path):
            os.remove(path)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(path, 0o755)

    def run_script(self, *options: str) -> subprocess.CompletedProcess:
        return subprocess.run([SCRIPT, *options], env={"PATH": self.here, "HERE": self.here}, capture_output=True, text=True)

    def apt_calls(self) -> list[str]:
        calls = os.path.join(self.here, "calls")
        if not os.path.exists(calls):
            return []
        with open(calls, encoding="utf-8") as file:
            return [line.strip() for line in file]

    def test_says_and_does_nothing_when_all_is_there(self):
        done = self.run_script()
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.assertEqual(self.apt_calls(), [])

    def test_asks_for_what_is_missing_and_no_more(self):
        self.write("missing", "libpng-dev\nlibgtest-dev\nclang\n")
        self.assertEqual(self.run_script().returncode, 0)
        self.assertRegex(self.apt_calls()[-1], r"install -y --no-install-recommends libpng-dev libgtest-dev$")

    def test_tells_how_far_it_is(self):
        self.write("missing", "libpng-dev\n")
        self.assertEqual(self.run_script().stdout.splitlines()[1:], ["  downloading: 25 %", "  unpacking and setting up: 100 %"])

    def test_to_run_it_needs_no_test_library(self):
        self.write("missing", "libpng-dev\nlibgtest-dev\n")
        self.assertEqual(self.run_script("--run").returncode, 0)
        self.assertRegex(self.apt_calls()[-1], r" libpng-dev$")

    def test_a_developer_gets_the_clang_tools(self):
        self.write("missing", "clang-tidy\n")
        self.assertEqual(self.run_script("--dev").returncode, 0)
        self.assertRegex(self.apt_calls()[-1], r" clang-tidy$")

    def test_fetches_the_index_when_it_is_too_old(self):
        self.write("missing", "libpng-dev\n")
        self.write("failures", "once\n")
        done = self.run_script()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(self.apt_calls()[-2], r" update$")
        self.assertRegex(self.apt_calls()[-1], r" libpng-dev$")

    def test_says_what_could_not_be_installed(self):
        self.write("missing", "libpng-dev\n")
        self.write("failures", "once\ntwice\n")
        done = self.run_script()
        self.assertEqual(done.returncode, 1)
        self.assertIn("E: Unable to locate package", done.stderr)
        self.assertIn("could not install libpng-dev", done.stderr)

    def test_without_apt_it_says_what_to_do(self):
        os.remove(os.path.join(self.here, "apt-get"))
        done = self.run_script()
        self.assertEqual(done.returncode, 1)
        self.assertIn("docs/dependencies.md", done.stderr)

    def test_without_root_and_sudo_it_says_what_to_do(self):
        self.write("missing", "libpng-dev\n")
        self.write("id", "#!/bin/bash\necho 1000\n")
        done = self.run_script()
        self.assertEqual(done.returncode, 1)
        self.assertIn("as root run: apt-get install libpng-dev", done.stderr)
        self.assertEqual(self.apt_calls(), [])

    def test_unknown_option(self):
        done = self.run_script("--everything")
        self.assertEqual(done.returncode, 2)
        self.assertIn("unknown option --everything", done.stderr)


if __name__ == "__main__":
    unittest.main()
