"""words.py: finds each old word where it must not be, and only there."""
import os
import tempfile
import unittest

import words


class Words(unittest.TestCase):
    def faults(self, path: str, text: str) -> list[str]:
        with tempfile.TemporaryDirectory() as root:
            os.makedirs(os.path.join(root, os.path.dirname(path)), exist_ok=True)
            with open(os.path.join(root, path), "w", encoding="utf-8") as file:
                file.write(text)
            return words.check(root)

    def test_finds_old_words_with_their_line(self):
        self.assertRegex(self.faults("docs/live.md", "a\nThe forerunner runs.\n")[0], r"^docs/live.md:2: `forerunner`")
        self.assertEqual(len(self.faults("kilvo/legs/x.hpp", "// It is said that\nclass Footfall;\n")), 2)
        self.assertEqual(len(self.faults("CHANGELOG.md", "## [Unreleased]\n- is said\n\n## [0.1.0]\n- is said\n")), 1)

    def test_finds_old_words_in_decisions(self):
        self.assertRegex(self.faults("docs/decisions/live.md", "The forerunner runs.\n")[0], r"^docs/decisions/live.md:1: `forerunner`")

    def test_finds_private_words_in_documents_and_in_the_estimator(self):
        self.assertRegex(self.faults("docs/outputs.md", "drift in % of the way\n")[0], r"^docs/outputs.md:1: `% of the way`")
        self.assertEqual(len(self.faults("kilvo/legs/x.hpp", "// The map begins anew.\n// An image tells nothing.\n")), 2)
        self.assertEqual(len(self.faults("README.md", "Each sense is mended.\n")), 2)
        self.assertEqual(self.faults("kilvo/legs/x_test.cpp", "// The map begins anew.\n"), [])

    def test_leaves_the_glossary_and_real_rooms_alone(self):
        self.assertEqual(self.faults("docs/notation.md", "forerunner\n"), [])
        self.assertEqual(self.faults("README.md", "A room with a floor, walls and a door.\n"), [])


if __name__ == "__main__":
    unittest.main()
