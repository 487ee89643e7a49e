include(bf_plugin)

# bf_group(target...): sources are compiled in groups, as one, since what their headers instantiate takes longer to
# compile than what they say themselves. Groups are small, so that an edit compiles in seconds.
set(BF_APART "" CACHE STRING "targets whose sources are compiled one by one, for who changes them again and again")
option(BF_EVERY_COMPILER "compare generated code and kernels with those of g++, too, when another compiler builds" OFF)
function(bf_group)
    foreach(target ${ARGN})
        if(NOT target IN_LIST BF_APART)
            set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 4)
        endif()
        # A class that uses a type without a name outside its file: it is a source's own, not a header's.
        target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
    endforeach()
endfunction()

# What nearly every source includes of the standard library, read once for all: a tenth of the time that sources take.
# Clang reads it with each of them, so that an include that is missing is seen there.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/common_headers.cpp CONTENT "")
add_library(bf_common_headers OBJECT EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/common_headers.cpp)
target_precompile_headers(bf_common_headers PRIVATE <algorithm> <array> <atomic> <cmath> <cstring> <filesystem> <fstream>
    <functional> <map> <memory> <optional> <set> <span> <sstream> <stdexcept> <string> <unordered_map> <variant> <vector>)
function(bf_common_headers target)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
        target_precompile_headers(${target} REUSE_FROM bf_common_headers)
    endif()
endfunction()

# The version of the paper's API (blockfactory::core) that is offered.
set(BF_API_VERSION 1.0.1)

# bf_package(NAME VERSION TEMPLATE): installs the package NAME; component or package is what the template calls it.
function(bf_package package version template)
    string(REGEX REPLACE "^BlockFactory" "" component ${package})
    include(CMakePackageConfigHelpers)
    configure_file(${template} ${package}Config.cmake @ONLY)
    write_basic_package_version_file(${package}ConfigVersion.cmake VERSION ${version} COMPATIBILITY AnyNewerVersion)
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${package}Config.cmake ${CMAKE_CURRENT_BINARY_DIR}/${package}ConfigVersion.cmake
        DESTINATION lib/cmake/${package})
endfunction()

# bf_library(NAME [SHARED] [OUTSIDE_STEPS] [PUBLIC target...] [PRIVATE target...] [PRECOMPILE header...])
#
# Target bf_NAME (alias bf::NAME) from src/*.cpp, include/ and what it links; header-only when src/ is empty. What runs
# OUTSIDE_STEPS is compiled at -O1, which takes two thirds of the time, and in larger groups, as most of what remains is
# what their headers instantiate. PRECOMPILE names headers of its own that are read once, in place of the common ones.
# Unit tests stand beside the sources: test/*_test.cpp become one program bf_NAME_test.
function(bf_library name)
    cmake_parse_arguments(arg "SHARED;OUTSIDE_STEPS" "" "PUBLIC;PRIVATE;TEST;PRECOMPILE" ${ARGN})
    file(GLOB_RECURSE sources CONFIGURE_DEPENDS src/*.cpp src/*.c)
    if(NOT sources)
        add_library(bf_${name} INTERFACE)
        target_include_directories(bf_${name} INTERFACE $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
        target_link_libraries(bf_${name} INTERFACE ${arg_PUBLIC})
    else()
        if(arg_SHARED)
            add_library(bf_${name} SHARED ${sources})
        else()
            add_library(bf_${name} STATIC ${sources})
        endif()
        target_include_directories(bf_${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> PRIVATE src)
        target_link_libraries(bf_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
        bf_group(bf_${name})
        if(arg_PRECOMPILE)
            target_precompile_headers(bf_${name} PRIVATE ${arg_PRECOMPILE})
        else()
            bf_common_headers(bf_${name})
        endif()
        if(arg_OUTSIDE_STEPS)
            target_compile_options(bf_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
            set_target_properties(bf_${name} PROPERTIES UNITY_BUILD_BATCH_SIZE 14)
        endif()
    endif()
    add_library(bf::${name} ALIAS bf_${name})
    file(GLOB tests CONFIGURE_DEPENDS test/*_test.cpp)
    if(tests)
        bf_test(${name} SOURCES ${tests} LINK bf_${name} ${arg_TEST})
    endif()
endfunction()

if(CMAKE_CROSSCOMPILING OR NOT BF_EVERYTHING) # tests run where they are built, and with all components
    function(bf_test)
    endfunction()
    return()
endif()

# What tests include, read once: programs of tests share one precompiled header.
file(WRITE ${CMAKE_BINARY_DIR}/test_headers.cpp "int main() {}\n")
add_executable(bf_test_headers EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/test_headers.cpp)
target_link_libraries(bf_test_headers PRIVATE GTest::gtest Eigen3::Eigen)
# A test runs once after each change; optimising it well would take longer than running it.
set(BF_TEST_OPTIONS $<$<CONFIG:Release>:-O1>)
target_compile_options(bf_test_headers PRIVATE ${BF_TEST_OPTIONS})
target_precompile_headers(bf_test_headers PRIVATE
    <gtest/gtest.h> <Eigen/Core> <algorithm> <array> <atomic> <chrono> <cmath> <cstring> <filesystem> <fstream> <functional>
    <map> <memory> <optional> <random> <set> <span> <sstream> <stdexcept> <string> <thread> <unordered_map> <variant> <vector>)

# Counts the calls of the heap in the test programs that link it.
add_library(bf_heap OBJECT EXCLUDE_FROM_ALL ${CMAKE_SOURCE_DIR}/tests/heap/heap.cpp)
target_include_directories(bf_heap INTERFACE ${CMAKE_SOURCE_DIR}/tests/heap)

# Expects work to take a time that grows with its size.
add_library(bf_growth INTERFACE)
target_include_directories(bf_growth INTERFACE ${CMAKE_SOURCE_DIR}/tests/growth)

# bf_test(NAME SOURCES file... LINK target... [SHARDS n]): one GoogleTest program bf_NAME_test and, as its cases are
# quicker than the start of a process, one ctest entry; SHARDS makes n of it, each with a part of the cases.
function(bf_test name)
    cmake_parse_arguments(arg "" "SHARDS" "SOURCES;LINK" ${ARGN})
    add_executable(bf_${name}_test ${arg_SOURCES})
    target_link_libraries(bf_${name}_test PRIVATE ${arg_LINK} GTest::gtest_main)
    target_compile_definitions(bf_${name}_test PRIVATE
        BF_SOURCE_DIRECTORY="${CMAKE_SOURCE_DIR}" BF_BINARY_DIRECTORY="${CMAKE_BINARY_DIR}"
        BF_SHARE="${BF_SHARE}" BF_PYTHON="${BF_PYTHON}")
    target_compile_options(bf_${name}_test PRIVATE ${BF_TEST_OPTIONS})
    target_precompile_headers(bf_${name}_test REUSE_FROM bf_test_headers)
    bf_group(bf_${name}_test)
    if(NOT arg_SHARDS)
        add_test(NAME ${name} COMMAND bf_${name}_test --gtest_brief=1)
        return()
    endif()
    math(EXPR last "${arg_SHARDS} - 1")
    foreach(shard RANGE ${last})
        add_test(NAME ${name}.${shard} COMMAND bf_${name}_test --gtest_brief=1)
        set_tests_properties(${name}.${shard} PROPERTIES
            ENVIRONMENT "GTEST_TOTAL_SHARDS=${arg_SHARDS};GTEST_SHARD_INDEX=${shard}")
    endforeach()
endfunction()
