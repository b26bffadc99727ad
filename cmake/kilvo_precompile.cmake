# kilvo_precompile(TARGET [TEST]): the target reads Eigen and the standard library (TEST: GoogleTest as well) precompiled.
# One precompiled header for code of libraries, one for programs, one for tests, and each for every level of optimisation: a compiler takes it
# only with the same flags, and GCC optimises at the level of the header, whatever the target says. It holds no header of the project, so that
# nothing is compiled anew because of it. Off where it would defeat a compiler cache, and for compilers other than GCC. Without it the same
# sources compile to the same code: they include what they use (`dev` builds without).
set(default_precompile ON)
if(CMAKE_CXX_COMPILER_LAUNCHER OR NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(default_precompile OFF)
endif()
option(KILVO_PRECOMPILE "Precompile Eigen and the standard library" ${default_precompile})

set(KILVO_PRECOMPILED_HEADERS
    <algorithm> <array> <chrono> <cmath> <cstdint> <deque> <filesystem> <functional> <map> <memory> <optional> <span> <string> <string_view>
    <tuple> <variant> <vector> <Eigen/Dense>)

# Made when first asked for.
function(kilvo_precompiled kind level out)
  set(header kilvo_precompiled_${kind}${level})
  set(${out} ${header} PARENT_SCOPE)
  if(TARGET ${header})
    return()
  endif()
  set(source ${PROJECT_BINARY_DIR}/${header}.cpp)
  if(kind STREQUAL "library")
    file(CONFIGURE OUTPUT ${source} CONTENT "")
    add_library(${header} OBJECT ${source})
  else()
    file(CONFIGURE OUTPUT ${source} CONTENT "int main() {}\n")
    add_executable(${header} EXCLUDE_FROM_ALL ${source})
  endif()
  target_link_libraries(${header} PRIVATE kilvo_flags Eigen3::Eigen)
  kilvo_optimization(${header} ${level})
  target_precompile_headers(${header} PRIVATE ${KILVO_PRECOMPILED_HEADERS})
  if(kind STREQUAL "test")
    target_link_libraries(${header} PRIVATE GTest::gmock)
    target_precompile_headers(${header} PRIVATE <gmock/gmock.h> <gtest/gtest.h>)
  endif()
endfunction()

function(kilvo_precompile target)
  if(NOT KILVO_PRECOMPILE)
    return()
  endif()
  get_target_property(type ${target} TYPE)
  get_property(level TARGET ${target} PROPERTY KILVO_OPTIMIZATION)
  if("TEST" IN_LIST ARGN)
    kilvo_precompiled(test "${level}" header)
  elseif(type STREQUAL "EXECUTABLE")
    kilvo_precompiled(program "${level}" header)
  else()
    kilvo_precompiled(library "${level}" header)
  endif()
  target_precompile_headers(${target} REUSE_FROM ${header})
endfunction()
