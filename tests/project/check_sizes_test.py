"""Each limit of scripts/check_sizes, exceeded once; and the shapes of C++ that it must measure rightly."""
import unittest

from planted_tree import PlantedTree


def function(lines: int, head: str = "int f(int x)") -> str:
    """A function of `lines` lines."""
    return f"{head} {{\n" + "  ++x;\n" * (lines - 2) + "}\n"


MANY_SHORT = "".join(function(3, f"int g{i}(int x)") for i in range(60))


class CheckSizes(PlantedTree):
    script = "check_sizes"

    def test_a_small_house_passes(self):
        self.assert_clean({})

    def test_file_too_long(self):
        self.assert_clean({"kilvo/map/new.cpp": "\n" * 300})
        self.assert_found({"kilvo/map/new.cpp": "\n" * 301}, "kilvo/map/new.cpp:300: the file has 301 lines, at most 300")

    def test_too_many_includes(self):
        includes = [f'#include "kilvo/math/x{i}.hpp"\n' for i in range(13)]
        self.assert_clean({"kilvo/map/new.cpp": "#include <cmath>\n" + "".join(includes[:12]), "lab/report/new.cpp": "".join(includes)})
        self.assert_found({"kilvo/map/new.cpp": "".join(includes)}, "kilvo/map/new.cpp: the file includes 13 of ours, at most 12")

    def test_test_file_too_long(self):
        self.assert_clean({"kilvo/map/new_test.cpp": "\n" * 500, "tests/stories/new.cpp": "\n" * 500})
        self.assert_found({"kilvo/map/new_test.cpp": "\n" * 501}, "kilvo/map/new_test.cpp:500: the file has 501 lines, at most 500")

    def test_function_too_long(self):
        self.assert_clean({"kilvo/map/new.cpp": function(80), "kilvo/math/short.cpp": MANY_SHORT})
        self.assert_found({"kilvo/map/new.cpp": "\n" + function(81), "kilvo/math/short.cpp": MANY_SHORT},
                          "kilvo/map/new.cpp:2: the function has 81 lines, at most 80 are allowed: int f(int x)")

    def test_every_shape_of_function_is_measured(self):
        shapes = {
            "template <class T, int N = 3> auto f(T x) -> std::pair<int, T>": "{}",
            "S::S(int x) : a_{x}, b_(x), c_{{x, x}}": "{}",
            "bool S::operator==(const S& o) const noexcept": "{}",
            "void S::operator()(int x) const": "{}",
            "int f(const std::vector<int>& v = {1, 2}, char c = '{')": "{}",
            'TEST(Map, Forgets)': "{}",
            "static int f(int x)": "namespace kilvo {{\nnamespace {{\n{}}}\n}}\n",
            "explicit S(int x) : a_(x)": "struct S : T<int> {{\n public:\n{}}};\n",
        }
        for head, around in shapes.items():
            self.assert_found({"kilvo/map/new.cpp": around.format(function(81, head)), "kilvo/math/short.cpp": MANY_SHORT},
                              "the function has 81 lines")

    def test_what_only_looks_long(self):
        for text in ("namespace kilvo {\n" + "int f();\n" * 90 + "}\n", "struct S {\n" + "  int f();\n" * 90 + "};\n",
                     "constexpr int t[] = {\n" + "  1,\n" * 90 + "};\n", "enum class E : int {\n" + "  a,\n" * 90 + "};\n",
                     "/* {\n" + "\n" * 90 + "} */\n",
                     'const char* s = R"(int f() {\n' + "\n" * 90 + '})";\n'):
            self.assert_clean({"kilvo/map/new.cpp": text})

    def test_a_lambda_counts_with_the_function_around_it(self):
        body = "int f(int x) {\n  auto g = [&](int y) {\n" + "    ++y;\n" * 77 + "  };\n}\n"
        self.assert_clean({"kilvo/map/new.cpp": body.replace("    ++y;\n", "", 2), "kilvo/math/short.cpp": MANY_SHORT})
        self.assert_found({"kilvo/map/new.cpp": body, "kilvo/math/short.cpp": MANY_SHORT}, "the function has 81 lines")

    def test_too_many_long_functions(self):
        long_ones = "".join(function(46, f"int long{i}(int x)") for i in range(4))
        self.assert_found({"kilvo/map/new.cpp": long_ones, "kilvo/math/short.cpp": MANY_SHORT}, "4 of 66 functions are over 45 lines",
                          *[f"kilvo/map/new.cpp:{1 + 46 * i}: 46 lines: int long{i}(int x)" for i in range(4)])
        self.assert_clean({"kilvo/map/new.cpp": long_ones.replace("  ++x;\n", "", 46), "kilvo/math/short.cpp": MANY_SHORT})

    def test_class_with_too_many_members(self):
        def members(data: int, functions: int) -> str:
            return ("class C {\n public:\n  explicit C(int x) : a_{x}, b_(x) {}\n  int f() const { return a_; }\n\n private:\n"
                    "  static constexpr int most = 3;\n  using Map = std::map<int, std::pair<int, int>>;\n  struct Entry {\n    int x, y;\n  };\n"
                    "  enum class Mode : int { off, on };\n  Map a_;\n  std::array<double, 2 * most + 1> b_{};\n"
                    "  std::function<bool(const Entry&)> c_ = [](const Entry& e) { return e.x > 0; };\n  int d_ = f(1, 2), e_ = 3;\n"
                    + "".join(f"  std::optional<std::pair<int, int>> data{i}_{{}};\n" for i in range(data - 5))
                    + "  template <class T>\n  void g(T x) const;\n  bool operator==(const C& o) const = default;\n"
                    + "".join(f"  int g{i}(std::vector<int> v = {{1, 2}}) const {{ return v[{i}]; }}\n" for i in range(functions - 2)) + "};\n")

        self.assert_clean({"kilvo/map/new.hpp": members(15, 12)})
        self.assert_found({"kilvo/map/new.hpp": members(16, 13)}, "kilvo/map/new.hpp:1: class C has 16 data members, at most 15 are allowed",
                          "kilvo/map/new.hpp:1: class C has 13 private functions, at most 12 are allowed")
        for elsewhere in ("lab/settings/new.hpp", "kilvo/map/new_test.cpp"):
            self.assert_clean({elsewhere: members(16, 13)})
        self.assert_clean({"kilvo/map/new.hpp": members(16, 13).replace("class C", "struct C")})

    def test_a_large_class_stays_as_it_is(self):
        head = "class VoxelMap {\n private:\n"
        self.assert_clean({"kilvo/map/new.hpp": head + "".join(f"  void f{i}();\n" for i in range(16)) + "};\n"})
        self.assert_found({"kilvo/map/new.hpp": head + "".join(f"  void f{i}();\n" for i in range(17)) + "};\n"},
                          "class VoxelMap has 17 private functions, at most 16 are allowed")

    def test_estimator_too_large(self):
        planted = {f"kilvo/map/planted_{i}.cpp": "\n" * 300 for i in range(56)}
        self.assert_found(planted, "lines without its tests, at most 16023 are allowed")
        self.assert_clean({path.replace("kilvo/map", "lab/settings"): text for path, text in planted.items()})


if __name__ == "__main__":
    unittest.main()
