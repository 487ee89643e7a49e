# Language, optimisation and tools of every target.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Release, Debug, Sanitize or SanitizeThreads" FORCE)
endif()

# Interpreter and generated code must agree bit for bit, so no contraction and no fast-math anywhere.
add_compile_options(-Wall -Wextra $<$<CXX_COMPILER_ID:GNU>:-Wshadow=local> -ffp-contract=off)
# GCC collects its garbage late: a twentieth of its time, for some hundred MB of memory.
add_compile_options($<$<COMPILE_LANG_AND_ID:CXX,GNU>:--param=ggc-min-heapsize=600000>)
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")
set(CMAKE_C_FLAGS_RELEASE "-O2 -DNDEBUG")
set(CMAKE_C_FLAGS_SANITIZE "-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=undefined")
# GCC, instrumenting, no longer sees that what std::optional and std::variant hold is initialised.
set(CMAKE_CXX_FLAGS_SANITIZE "${CMAKE_C_FLAGS_SANITIZE} -Wno-maybe-uninitialized")
set(CMAKE_EXE_LINKER_FLAGS_SANITIZE "-fsanitize=address,undefined")
set(CMAKE_SHARED_LINKER_FLAGS_SANITIZE "-fsanitize=address,undefined")
set(CMAKE_C_FLAGS_SANITIZETHREADS "-O1 -g1 -fsanitize=thread")
# Fences are not seen; what stands between them is atomic (bf/core/sequence_lock.hpp).
set(CMAKE_CXX_FLAGS_SANITIZETHREADS "${CMAKE_C_FLAGS_SANITIZETHREADS} -Wno-tsan -Wno-maybe-uninitialized")
set(CMAKE_EXE_LINKER_FLAGS_SANITIZETHREADS "-fsanitize=thread")
set(CMAKE_SHARED_LINKER_FLAGS_SANITIZETHREADS "-fsanitize=thread")

# The binary wheels were built with 16-byte Eigen alignment and plain malloc; both sides must agree.
add_compile_definitions(EIGEN_MAX_ALIGN_BYTES=16 EIGEN_MALLOC_ALREADY_ALIGNED=1)

find_program(CCACHE ccache)
if(CCACHE)
    # What ccache needs to know about precompiled headers.
    set(CCACHE ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
    set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE})
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
set(BF_PLUGIN_DIRECTORY ${CMAKE_BINARY_DIR}/lib/blockfactory)
