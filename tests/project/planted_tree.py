"""A tiny project in a temporary folder, for tests that plant one violation and look for the message."""
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SCRIPTS = os.path.join(ROOT, "scripts")

MODULES = """# a tree of five modules
kilvo/math:
kilvo/map: kilvo/math
lab/settings: kilvo/*
apps/cli: kilvo/* lab/*
tests: kilvo/* lab/*
reserve <yaml-cpp/: lab/settings
reserve <tbb/: kilvo/math/sum.hpp
reserve <iostream>: lab apps tests
"""

CLEAN = {
    "modules.txt": MODULES,
    "kilvo/math/sum.hpp": '#pragma once\n#include <tbb/parallel_for.h>\nnamespace kilvo {\nint sum(int a, int b);\n}\n',
    "kilvo/math/sum.cpp": '#include "kilvo/math/sum.hpp"\nnamespace kilvo {\nint sum(int a, int b) { return a + b; }\n}\n',
    "kilvo/math/sum_test.cpp": '#include <gtest/gtest.h>\n#include "kilvo/math/sum.hpp"\nTEST(Sum, Adds) {}\n',
    "kilvo/map/map.hpp": '#pragma once\n#include "kilvo/math/sum.hpp"\n',
    "lab/settings/load.cpp": '#include <yaml-cpp/yaml.h>\n#include <iostream>\n#include "kilvo/map/map.hpp"\n',
    "tests/stories/story.cpp": '#include <gtest/gtest.h>\n#include <iostream>\n#include "lab/settings/load.hpp"\n',
    "lab/settings/load.hpp": "#pragma once\n",
}


class PlantedTree(unittest.TestCase):
    script = ""  # the script under test, in scripts/

    def run_on(self, planted: dict[str, str], clean: dict[str, str] = CLEAN) -> tuple[int, str]:
        """Exit code and output of the script on the clean tree with `planted` files added or replaced."""
        with tempfile.TemporaryDirectory() as root:
            for path, text in {**clean, **planted}.items():
                os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
                with open(os.path.join(root, path), "w", encoding="utf-8") as file:
                    file.write(text)
            done = subprocess.run([sys.executable, os.path.join(SCRIPTS, self.script), "--root", root], capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        return done.returncode, done.stdout

    def assert_clean(self, planted: dict[str, str]) -> None:
        code, output = self.run_on(planted)
        self.assertEqual(code, 0, output)

    def assert_found(self, planted: dict[str, str], *messages: str) -> None:
        """The script fails, and says each of `messages`, and nothing else."""
        code, output = self.run_on(planted)
        self.assertEqual(code, 1, output)
        for message in messages:
            self.assertIn(message, output)
        self.assertEqual(len(output.splitlines()) - 1, len(messages), output)
