# Compiler settings common to every target, and the two functions the folders use.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

option(FREEVOXEL_WERROR "Treat warnings as errors" ON)
option(FREEVOXEL_SANITIZE "Build with the address and undefined behaviour sanitizers" OFF)
option(FREEVOXEL_JOIN_SOURCES "Compile the program's and the tests' files several at a time: most of their time is headers"
       ON)

set(FREEVOXEL_TEST_SHARDS 0 CACHE STRING "Run each test program as so many CTest tests, 0: one for every case of it.
A program with sanitizers takes long to start")

find_package(PkgConfig REQUIRED)
find_package(OpenMP REQUIRED COMPONENTS CXX)
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)
find_package(glm REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
pkg_check_modules(OpenImageIO REQUIRED IMPORTED_TARGET OpenImageIO)
pkg_check_modules(XxHash REQUIRED IMPORTED_TARGET libxxhash)
pkg_check_modules(Egl REQUIRED IMPORTED_TARGET egl)
pkg_check_modules(Epoxy REQUIRED IMPORTED_TARGET epoxy)
include(FreevoxelReaders)

add_library(freevoxel_settings INTERFACE)
target_include_directories(freevoxel_settings INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(freevoxel_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wimplicit-fallthrough
  # A fused multiply-add rounds once where the shaders round twice: backends would differ.
  -ffp-contract=off
  # Options structs are filled by designated initialisers; what is not named has its default.
  -Wno-missing-field-initializers
  # gcc 12 warns of overlaps inside std::string's own operator+ (its bug 105651).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  $<$<BOOL:${FREEVOXEL_WERROR}>:-Werror>)
if(FREEVOXEL_SANITIZE)
  target_compile_options(freevoxel_settings INTERFACE
    -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(freevoxel_settings INTERFACE -fsanitize=address,undefined)
  # Highway's oldest instruction sets are the release build's matter: each takes as long to compile as the one that runs.
  target_compile_definitions(freevoxel_settings INTERFACE "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_SSE4)")
endif()
target_link_libraries(freevoxel_settings INTERFACE Threads::Threads)

# freevoxel_library(NAME SOURCES ... LINKS ...): the one library of a folder, freevoxel_NAME.
function(freevoxel_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINKS" ${ARGN})
  add_library(freevoxel_${name} STATIC ${arg_SOURCES})
  target_link_libraries(freevoxel_${name} PUBLIC freevoxel_settings ${arg_LINKS})
endfunction()

add_custom_target(quick_tests)

# freevoxel_test(NAME SOURCES ... LINKS ... [LABELS label]): a GoogleTest program; every case of it is a CTest test
# (FREEVOXEL_TEST_SHARDS apart).
# Tests labelled "quick" also run under the sanitizers (target quick_tests builds them and what they need), those labelled
# "full" only in scripts/test_full.sh. (One label: gtest_discover_tests would take a second one, or an empty one, for the
# next property.) Files that define the same names have a namespace of their own, since several are compiled at a time.
function(freevoxel_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "SOURCES;LINKS;LABELS" ${ARGN})
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 600)
  endif()
  if(arg_LABELS)
    set(labels LABELS ${arg_LABELS})
  endif()
  add_executable(${name} ${arg_SOURCES})
  if(arg_LABELS STREQUAL "quick")
    add_dependencies(quick_tests ${name})
  endif()
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${FREEVOXEL_JOIN_SOURCES} UNITY_BUILD_BATCH_SIZE 5)
  # Tests wait for what they test, not for themselves. A fixture may live in an unnamed namespace (gcc only warns of it
  # where files are joined).
  target_compile_options(${name} PRIVATE -O1 $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  target_link_libraries(${name} PRIVATE ${arg_LINKS} freevoxel_test_support)
  if(FREEVOXEL_TEST_SHARDS GREATER 0)
    math(EXPR last "${FREEVOXEL_TEST_SHARDS} - 1")
    foreach(shard RANGE ${last})
      add_test(NAME ${name}_${shard} COMMAND ${name})
      set_tests_properties(${name}_${shard} PROPERTIES ${labels} TIMEOUT 1200
        ENVIRONMENT "${FREEVOXEL_TEST_ENVIRONMENT};GTEST_TOTAL_SHARDS=${FREEVOXEL_TEST_SHARDS};GTEST_SHARD_INDEX=${shard}")
    endforeach()
    return()
  endif()
  gtest_discover_tests(${name}
    DISCOVERY_TIMEOUT 60
    PROPERTIES ${labels} TIMEOUT ${arg_TIMEOUT}
    ENVIRONMENT "${FREEVOXEL_TEST_ENVIRONMENT}")
endfunction()
