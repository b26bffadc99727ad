# kilvo_module(NAME [UNIT files] [OPTIMIZATION level] [DEPENDS target...] [PRIVATE target...] [TEST_DEPENDS target...])
#
# One folder is one module is one CMake target, `kilvo_NAME` (alias `kilvo::NAME`): every *.cpp is compiled,
# every *_test.cpp beside it goes into one test program `kilvo_NAME_test`. Every *.hpp compiles alone (scripts/check_headers).
# What a module may include is listed in modules.txt and checked by scripts/check_modules.

add_library(kilvo_flags INTERFACE)
# In a unit of several files a local may have the name of a helper in the file before.
target_compile_options(kilvo_flags INTERFACE -Wall -Wextra -Wconversion $<$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wshadow> -fno-math-errno
                                             -fno-trapping-math $<$<BOOL:${KILVO_WARNINGS_AS_ERRORS}>:-Werror>)
# g++ 12 warns at -O3 of what cannot be in the standard library's own inlined code, most of all behind precompiled headers, where it no longer knows
# them as the system's: reported, but no reason to stop.
target_compile_options(kilvo_flags INTERFACE
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${KILVO_WARNINGS_AS_ERRORS}>>:-Wno-error=array-bounds;-Wno-error=stringop-overflow;-Wno-error=stringop-overread;-Wno-error=maybe-uninitialized;-Wno-error=restrict>)

# Functions marked KILVO_WIDE are compiled twice, for any x86-64 and for AVX2; which one runs is decided when the program starts. Both give
# the same bits, since products and sums are not fused. Sanitizers do not stand the choice.
set(KILVO_WIDE "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT CMAKE_CXX_FLAGS MATCHES "sanitize")
  set(KILVO_WIDE "__attribute__((target_clones(\"avx2\",\"default\")))")
endif()
target_compile_definitions(kilvo_flags INTERFACE "KILVO_WIDE=${KILVO_WIDE}")

# kilvo_optimization(TARGET [level]): of a release, where the target has no loop that counts: it compiles in three quarters of the time. The
# results keep their bytes at any level. Comes before kilvo_precompile.
function(kilvo_optimization target)
  if(ARGC GREATER 1)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O${ARGV1}>)
    set_target_properties(${target} PROPERTIES KILVO_OPTIMIZATION ${ARGV1})
  endif()
endfunction()

# kilvo_compile(TARGET [TEST] [UNIT files] [OPTIMIZATION level]): with precompiled headers, in units, at that level in a release.
function(kilvo_compile target)
  cmake_parse_arguments(COMPILE "TEST" "UNIT;OPTIMIZATION" "" ${ARGN})
  kilvo_optimization(${target} ${COMPILE_OPTIMIZATION})
  if(COMPILE_TEST)
    kilvo_precompile(${target} TEST)
  else()
    kilvo_precompile(${target})
  endif()
  kilvo_unity(${target} ${COMPILE_UNIT})
endfunction()

# kilvo_test(TARGET): how a program of tests is compiled: what counts of its time is spent in the libraries. Each file of tests has a namespace
# of its own name, so that several make one unit.
function(kilvo_test target)
  kilvo_compile(${target} TEST OPTIMIZATION 1)
endfunction()

function(kilvo_module name)
  cmake_parse_arguments(MODULE "" "UNIT;OPTIMIZATION" "DEPENDS;PRIVATE;TEST_DEPENDS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  file(GLOB tests CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_test.cpp)
  file(GLOB fuzzers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_fuzz.cpp)
  if(tests)
    list(REMOVE_ITEM sources ${tests})
  endif()
  if(fuzzers)
    list(REMOVE_ITEM sources ${fuzzers})
  endif()

  set(target kilvo_${name})
  if(sources)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:kilvo_flags> ${MODULE_PRIVATE})
    kilvo_compile(${target} UNIT ${MODULE_UNIT} OPTIMIZATION ${MODULE_OPTIMIZATION})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(kilvo::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(${target} ${scope} cxx_std_20)
  target_link_libraries(${target} ${scope} ${MODULE_DEPENDS})

  if(tests AND BUILD_TESTING)
    add_executable(${target}_test ${tests})
    target_link_libraries(${target}_test PRIVATE ${target} kilvo_flags ${MODULE_PRIVATE} ${MODULE_TEST_DEPENDS} GTest::gmock GTest::gtest_main)
    target_compile_definitions(${target}_test PRIVATE KILVO_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    kilvo_test(${target}_test)
    gtest_discover_tests(${target}_test TEST_PREFIX ${name}/ DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 300)
  endif()
  if(fuzzers AND KILVO_BUILD_FUZZERS)
    foreach(fuzzer ${fuzzers})
      get_filename_component(fuzz_name ${fuzzer} NAME_WE)
      add_executable(${fuzz_name} ${fuzzer})
      target_compile_options(${fuzz_name} PRIVATE -fsanitize=fuzzer)
      target_link_options(${fuzz_name} PRIVATE -fsanitize=fuzzer)
      target_link_libraries(${fuzz_name} PRIVATE ${target} ${MODULE_PRIVATE})
    endforeach()
  endif()
endfunction()
