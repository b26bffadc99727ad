"""scripts/check_constants: what it counts, what it does not, and that one too many is found."""
import re
import unittest

from planted_tree import PlantedTree

LIMIT = 443


class CheckConstants(PlantedTree):
    script = "check_constants"

    def count(self, text: str, path: str = "kilvo/map/new.cpp") -> int:
        code, output = self.run_on({path: text})
        self.assertEqual(code, 0, output)
        return int(re.search(r"kilvo/ has (\d+) named constants", output)[1])

    def test_one_too_many(self):
        text = "".join(f"constexpr int c{i} = {i};\n" for i in range(LIMIT))
        self.assertEqual(self.count(text), LIMIT)
        self.assert_found({"kilvo/map/new.cpp": text + "constexpr int one_more = 1;\n"},
                          f"kilvo/ has {LIMIT + 1} named constants, at most {LIMIT} are allowed")

    def test_a_constant_without_a_row_and_a_row_without_a_constant(self):
        page = "## map (2)\n| source | constants | kind | why |\n|---|---|---|---|\n| new.cpp | `a` 1, `gone` 2 | floor | m |\n"
        self.assert_found({"kilvo/map/new.cpp": "constexpr int a = 1, b = 2;\n", "docs/decisions/constants.md": page},
                          "no row for b of kilvo/map/new.cpp", "there is no gone in kilvo/map")

    def test_every_declarator_counts(self):
        for text, names in {
            "constexpr double a = 1, b = 2;\n": 2,
            "struct S {\n  static constexpr int a = 1;\n};\n": 1,
            "int f() {\n  constexpr double a = 1, b = f(1, 2), c = {3};\n  return a;\n}\n": 3,
            "inline constexpr std::array<double, 2> a = {1, 2}, b{3, 4};\n": 2,
            'constexpr const char* names[] = {"a, b = 1", "c"};\n': 1,
            "constexpr Duration a = std::chrono::seconds(1), b = Duration(std::int64_t{1} << 60);\n": 2,
            "template <class M>\ninline constexpr int rows = std::remove_cvref_t<M>::most;\n": 1,
            "const double steepest = std::cos(0.5);\n": 1,
            "void f() {\n  const double x = 0.3;\n}\n": 1,
        }.items():
            self.assertEqual(self.count(text), names, text)

    def test_what_is_no_constant(self):
        for text in ("constexpr int f(int x) { return x; }\n", "constexpr auto f = [](int x) { return x; };\n",
                     "void f(int x) {\n  if constexpr (true) ++x;\n  const double y = x, z = 2 * y;\n}\n",
                     "// constexpr int a = 1;\n", "struct MapConfig {\n  static constexpr int a = 1;\n  static constexpr auto fields() { return 1; }\n};\n",
                     "double f(const double& x);\n"):
            self.assertEqual(self.count(text), 0, text)

    def test_where_it_looks(self):
        for path in ("kilvo/map/new_test.cpp", "kilvo/map/map_config.hpp", "lab/settings/new.cpp", "apps/cli/new.cpp", "tests/stories/new.cpp"):
            self.assertEqual(self.count("constexpr int a = 1;\n", path), 0, path)


if __name__ == "__main__":
    unittest.main()
