"""Each rule of scripts/check_modules, broken once: the message must name the file, the line and the rule."""
import unittest

from planted_tree import MODULES, PlantedTree

MATH = "kilvo/math/new.hpp"
HEADER = "#pragma once\n"


class CheckRooms(PlantedTree):
    script = "check_modules"

    def test_a_clean_house_passes(self):
        self.assert_clean({})

    def test_forbidden_include(self):
        self.assert_found({MATH: HEADER + '#include "kilvo/map/map.hpp"\n'},
                          "kilvo/math/new.hpp:2: kilvo/math must not include kilvo/map/map.hpp",
                          "cycle among modules: kilvo/map -> kilvo/math -> kilvo/map")

    def test_forbidden_include_written_in_angle_brackets(self):
        self.assert_found({"kilvo/map/new.cpp": "#include <lab/settings/load.hpp>\n"},
                          "kilvo/map/new.cpp:1: kilvo/map must not include",
                          "cycle among modules")

    def test_an_include_in_a_comment_or_string_is_none(self):
        self.assert_clean({MATH: HEADER + '// #include <iostream>\n/*\n#include "lab/settings/load.hpp"\n*/\n'})

    def test_include_that_is_no_file(self):
        self.assert_found({MATH: HEADER + '#include "sum.hpp"\n'}, 'kilvo/math/new.hpp:2: "sum.hpp" is no file of the project')

    def test_source_included(self):
        self.assert_found({"kilvo/math/new.cpp": '#include "kilvo/math/sum.cpp"\n'},
                          "kilvo/math/new.cpp:1: kilvo/math/sum.cpp is not a header")

    def test_undeclared_room(self):
        self.assert_found({"kilvo/attic/box.cpp": "\n", "kilvo/attic/trunk.cpp": "\n"},
                          "kilvo/attic/box.cpp:1: kilvo/attic is an undeclared module")

    def test_undeclared_folder_inside_a_room(self):
        self.assert_found({"kilvo/math/detail/box.cpp": "\n"}, "kilvo/math/detail is an undeclared module")

    def test_a_room_that_rooms_txt_only_mentions(self):
        self.assert_found({"modules.txt": MODULES + "bench: kilvo/maths\n"}, "modules.txt:10: bench names kilvo/maths, which is no module")

    def test_a_line_of_rooms_txt_that_says_nothing(self):
        self.assert_found({"modules.txt": MODULES + "let me in\n"}, "modules.txt:10: not understood: let me in")

    def test_a_room_listed_twice(self):
        self.assert_found({"modules.txt": MODULES + "kilvo/map: kilvo/math\n"}, "modules.txt:10: kilvo/map is listed twice")

    def test_reserved_header_in_another_room(self):
        self.assert_found({"kilvo/map/new.cpp": "#include <yaml-cpp/yaml.h>\n"},
                          "kilvo/map/new.cpp:1: <yaml-cpp/yaml.h> is reserved for lab/settings (modules.txt:7)")

    def test_header_reserved_for_one_file_in_another_file_of_the_room(self):
        self.assert_found({MATH: HEADER + "#include <tbb/parallel_for.h>\n"}, "<tbb/parallel_for.h> is reserved for kilvo/math/sum.hpp")

    def test_cycle_in_the_rules(self):
        self.assert_found({"modules.txt": MODULES.replace("kilvo/math:", "kilvo/math: kilvo/map")},
                          "cycle among modules: kilvo/map -> kilvo/math -> kilvo/map")

    def test_using_namespace_in_a_header(self):
        self.assert_found({MATH: HEADER + "using namespace std;\n"}, "kilvo/math/new.hpp:2: no `using namespace` in headers")
        self.assert_clean({"kilvo/math/new.cpp": "using namespace std;\n"})

    def test_macro_in_a_header(self):
        self.assert_found({MATH: HEADER + "#define PI 3\n"}, "kilvo/math/new.hpp:2: no macros in headers")

    def test_header_without_pragma_once(self):
        self.assert_found({MATH: "int f();\n"}, "kilvo/math/new.hpp:1: a header begins with #pragma once")

    def test_files_and_printing_in_the_estimator(self):
        for header in ("iostream", "fstream", "cstdio", "filesystem"):
            self.assert_found({"kilvo/map/new.cpp": f"\n#include <{header}>\n"},
                              f"kilvo/map/new.cpp:2: <{header}> has no place in kilvo/")
            self.assert_clean({"apps/cli/new.cpp": f"#include <{header}>\n"})
        self.assert_found({"kilvo/map/new.cpp": 'void f() { std::cerr << "x"; }\n'},
                          "kilvo/map/new.cpp:1: nothing is printed in kilvo/")

    def test_wall_clock_in_the_estimator(self):
        self.assert_found({"kilvo/map/new.cpp": "auto f() { return std::chrono::system_clock::now(); }\n"},
                          "there is no wall clock in kilvo/")

    def test_chance_in_the_estimator(self):
        self.assert_found({"kilvo/map/new.cpp": "int f() { return std::random_device{}(); }\n"}, "no random_device")

    def test_mutable_globals(self):
        for code in ("int count = 0;", "static std::vector<int> seen;", "namespace {\nint count;\n}",
                     "thread_local int count = 1;",
                     "int f() {\n  static int calls = 0;\n  return ++calls;\n}",
                     "struct S {\n  static int count;\n};", "std::function<void(int)> hook;"):
            self.assert_found({"lab/settings/new.cpp": code + "\n"}, "mutable global or static")

    def test_what_is_no_mutable_global(self):
        for code in ("constexpr int count = 0;", "static const std::vector<int> seen = {1, 2};", "static int f(int x);",
                     "struct S {\n  int count = 0;\n};", "int f() {\n  int calls = 0;\n  return ++calls;\n}", "using Count = int;",
                     "enum class E { a, b };",
                     "template <class T> class S;", "struct S {\n  static S make(int x);\n};"):
            self.assert_clean({"lab/settings/new.cpp": code + "\n"})

    def test_test_library_outside_tests(self):
        self.assert_found({"kilvo/map/new.cpp": "#include <gtest/gtest.h>\n"}, "<gtest/gtest.h> belongs in tests")

    def test_a_unit_test_is_held_to_its_room(self):
        self.assert_found({"kilvo/map/map_test.cpp": '#include "lab/settings/load.hpp"\n'},
                          "kilvo/map/map_test.cpp:1: kilvo/map must not include")
        self.assert_found({"kilvo/map/map_test.cpp": "#include <fstream>\n"}, "kilvo/map/map_test.cpp:1: <fstream> has no place")

    def test_a_unit_test_may_include_what_a_test_only_line_says(self):
        modules = MODULES + "test-only kilvo/map: lab/settings <fstream> <yaml-cpp/\n"
        include = '#include <fstream>\n#include <yaml-cpp/yaml.h>\n#include "lab/settings/load.hpp"\n'
        self.assert_clean({"modules.txt": modules, "kilvo/map/map_test.cpp": include, "kilvo/map/map_fuzz.cpp": include})
        self.assert_found({"modules.txt": modules, "kilvo/map/new.cpp": include},
                          "new.cpp:1: <fstream>", "new.cpp:2: <yaml-cpp/yaml.h>", "new.cpp:3: kilvo/map must not include",
                          "cycle among modules")


if __name__ == "__main__":
    unittest.main()
