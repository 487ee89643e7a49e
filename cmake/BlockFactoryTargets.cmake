include(GoogleTest)
include(bf_plugin)

# bf_library(NAME [SHARED] [PUBLIC target...] [PRIVATE target...])
#
# Target bf_NAME (alias bf::NAME) from src/*.cpp, include/ and what it links; header-only when src/ is empty.
# Unit tests stand beside the sources: test/*_test.cpp become one program bf_NAME_test.
function(bf_library name)
    cmake_parse_arguments(arg "SHARED" "" "PUBLIC;PRIVATE;TEST" ${ARGN})
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
    endif()
    add_library(bf::${name} ALIAS bf_${name})
    file(GLOB tests CONFIGURE_DEPENDS test/*_test.cpp)
    if(tests)
        bf_test(${name} SOURCES ${tests} LINK bf_${name} ${arg_TEST})
    endif()
endfunction()

# bf_test(NAME SOURCES file... LINK target...): one GoogleTest program, its cases registered with ctest.
function(bf_test name)
    cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
    add_executable(bf_${name}_test ${arg_SOURCES})
    target_link_libraries(bf_${name}_test PRIVATE ${arg_LINK} GTest::gtest_main)
    target_compile_definitions(bf_${name}_test PRIVATE
        BF_SOURCE_DIRECTORY="${CMAKE_SOURCE_DIR}" BF_BINARY_DIRECTORY="${CMAKE_BINARY_DIR}"
        BF_SHARE="${BF_SHARE}" BF_PYTHON="${BF_PYTHON}")
    gtest_discover_tests(bf_${name}_test DISCOVERY_MODE PRE_TEST TEST_PREFIX ${name}.)
endfunction()
