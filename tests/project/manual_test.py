"""scripts/make_manual: every verb and option of the program is in the manual page and in both completions, which are well-formed."""
import argparse
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

# A program with two verbs, one of which has verbs of its own.
STAND_IN = """#!/bin/bash
case "$*" in
  --version) echo 'kilvo 1.2.3' ;;
  --help) printf 'Odometry.\\nUsage: kilvo [OPTIONS] [VERB]\\n\\nOptions:\\n  -h,--help       this text\\n\\nVerbs:\\n  run         estimate it\\n  config      settings\\n\\nExit codes: 0\\n' ;;
  'run --help') printf "estimate it\\nUsage: kilvo run [OPTIONS] INPUT\\n\\nPositionals:\\n  INPUT TEXT REQUIRED    a bag: [any]\\n\\nOptions:\\n  --threads N:INT in [1 - 9]\\n                  so many\\n" ;;
  'config --help') printf 'settings\\nUsage: kilvo config VERB\\n\\nSubcommands:\\n  show      print them\\n' ;;
  'config show --help') printf 'print them\\nUsage: kilvo config show\\n\\nOptions:\\n  --markdown      as tables\\n' ;;
esac
"""


class Manual(unittest.TestCase):
    program = ""

    def made(self) -> dict[str, str]:
        with tempfile.TemporaryDirectory() as folder:
            program = self.program
            if not program:
                program = os.path.join(folder, "kilvo")
                with open(program, "w", encoding="utf-8") as file:
                    file.write(STAND_IN)
                os.chmod(program, 0o755)
            subprocess.run([os.path.join(ROOT, "scripts/make_manual"), "--kilvo", program, "--out", folder], check=True)
            files = {}
            for name in ("kilvo.1", "kilvo.bash", "_kilvo"):
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    files[name] = file.read()
            return files

    def test_says_what_the_help_says(self):
        files = self.made()
        self.assertIn('.SS "kilvo run"', files["kilvo.1"])
        options = ("--threads", "--markdown")
        for option in options:
            self.assertIn(option.replace("-", "\\-"), files["kilvo.1"])
            self.assertIn(option, files["kilvo.bash"])
            self.assertIn(option, files["_kilvo"])
        self.assertTrue(files["_kilvo"].startswith("#compdef kilvo\n"))

    def test_completes_verbs_and_options_in_bash(self):
        script = self.made()["kilvo.bash"] + """
ask() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _kilvo; echo "${COMPREPLY[*]}"; }
ask kilvo ru; ask kilvo run --thr; ask kilvo config sh; ask kilvo config show --mark
"""
        done = subprocess.run(["bash", "-c", script], capture_output=True, text=True)
        self.assertEqual((done.stdout.split("\n")[:4], done.stderr), (["run", "--threads", "show", "--markdown"], ""))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--kilvo", default="", help="the program; a stand-in by default")
    Manual.program, rest = (lambda known: (known[0].kilvo, known[1]))(parser.parse_known_args())
    unittest.main(argv=[sys.argv[0], *rest])
