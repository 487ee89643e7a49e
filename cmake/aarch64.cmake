# CMake toolchain file for aarch64: Debian's cross compiler, and the libraries that `scripts/deps-aarch64` installs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

cmake_path(SET deps NORMALIZE ${CMAKE_CURRENT_LIST_DIR}/../.deps/aarch64)
set(CMAKE_SYSROOT ${deps}/sysroot)
set(CMAKE_FIND_ROOT_PATH ${deps}/wheels ${CMAKE_PREFIX_PATH}) # a named prefix is the target's, too
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig)
