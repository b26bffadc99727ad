"""tests/project/documents.py on a small tree, with one untruth in each document."""
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))

TREE = {
    "modules.txt": "kilvo/math:\nreserve <x: kilvo/math\n",
    "kilvo/math/so3.hpp": "struct SO3 { int Exp(int p_W); };\n",
    "docs/architecture.md": "`kilvo/math` holds `SO3::Exp`, see [notation](notation.md).\n```text\nmath/ `Nonsense`\n```\n",
    "docs/notation.md": "`_W` is the world: `x.Exp(p_W)`.\n",
}


class Documents(unittest.TestCase):
    def faults_of(self, planted: dict[str, str]) -> str:
        with tempfile.TemporaryDirectory() as root:
            for path, text in {**TREE, **planted}.items():
                os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
                with open(os.path.join(root, path), "w", encoding="utf-8") as file:
                    file.write(text)
            done = subprocess.run([sys.executable, os.path.join(HERE, "documents.py"), "--root", root], capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        self.assertEqual(done.returncode, 0 if done.stdout == "documents: 0 faults\n" else 1)
        return done.stdout

    def test_true_documents(self):
        self.assertEqual(self.faults_of({}), "documents: 0 faults\n")

    def test_a_name_that_the_sources_do_not_have(self):
        self.assertIn("docs/notation.md:2: there is no Log (`SO3::Log`)", self.faults_of({"docs/notation.md": "\n`SO3::Log`\n"}))

    def test_a_link_that_leads_nowhere(self):
        self.assertIn("docs/decisions/a.md:1: ../b.md does not exist", self.faults_of({"docs/decisions/a.md": "[b](../b.md)\n"}))

    def test_a_room_that_is_not_on_the_page(self):
        self.assertIn("the module kilvo/map is not on the page", self.faults_of({"modules.txt": TREE["modules.txt"] + "kilvo/map: kilvo/math\n"}))


if __name__ == "__main__":
    unittest.main()
