# Every library comes from Debian or from the wheels in .deps (see scripts/deps); CMake downloads nothing.
set(BF_DEPS ${CMAKE_SOURCE_DIR}/.deps CACHE PATH "folder that scripts/deps filled")
if(CMAKE_CROSSCOMPILING)
    file(GLOB BF_SITE ${BF_DEPS}/${CMAKE_SYSTEM_PROCESSOR}/wheels)
else()
    file(GLOB BF_SITE ${BF_DEPS}/venv/lib/python3.*/site-packages)
endif()

# Components that a build may leave out. Folders are tested where both are there, what is left by tests/reduced.
option(BF_SUNDIALS "CVODE's solvers and the solution of algebraic loops" ON)
option(BF_ROBOTS "the Whole-Body Toolbox, its physics, and films" ON)
option(BF_WHEEL "what goes into the wheel, see pyproject.toml" OFF)
option(BF_PYTHON_API "the Python package, for which scripts/deps-python installs what it needs" OFF)
option(BF_FMI "FMUs" ON)
option(BF_YARP "robots and streams of YARP, where scripts/deps-yarp has built it or CMake finds it" ON)
option(BF_ROS2 "robots and topics of ROS 2, where scripts/deps-ros2 has installed it or AMENT_PREFIX_PATH leads to it" ON)
option(BF_ROS1 "robots and topics of ROS 1 and its bags, where scripts/deps-ros1 has installed roscpp" ON)
if(BF_SUNDIALS AND BF_ROBOTS AND BF_FMI AND NOT BF_WHEEL)
    set(BF_EVERYTHING ON)
endif()
if(NOT BF_SITE AND BF_ROBOTS)
    message(FATAL_ERROR "${BF_DEPS} holds no packages: run 'make deps' or, for aarch64, 'make aarch64'")
endif()
set(BF_PYTHON ${BF_DEPS}/venv/bin/python)
if(NOT BF_SITE)
    set(BF_PYTHON python3)
endif()
set(BF_SHARE ${BF_DEPS}/venv/share) # robot models of the icub-models wheel
if(BF_WHEEL) # goes to computers without that folder; there packages of the system may have robots
    set(BF_SHARE /usr/share)
endif()
set(BF_DAQP_SOURCES ${BF_DEPS}/src/daqp-0.11.0/csrc)
set(BF_OSQP_SOURCES ${BF_DEPS}/src/osqp-0.6.7.post3/osqp_sources)
set(BF_RUCKIG_SOURCES ${BF_DEPS}/src/ruckig-0.19.4)

set(CMAKE_FIND_PACKAGE_PREFER_CONFIG ON) # the module FindBoost does not know the wheel's Boost
list(PREPEND CMAKE_PREFIX_PATH ${BF_SITE}/cmeel.prefix ${BF_SITE}/idyntree)
set(MuJoCo_ROOT ${BF_SITE}/mujoco)

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(matio REQUIRED IMPORTED_TARGET matio)
pkg_check_modules(libdeflate REQUIRED IMPORTED_TARGET libdeflate)
pkg_check_modules(zlib REQUIRED IMPORTED_TARGET zlib)
pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(lz4 REQUIRED IMPORTED_TARGET liblz4)
if(NOT CMAKE_CROSSCOMPILING AND NOT BF_WHEEL)
    find_package(BZip2 QUIET) # for chunks of bags of ROS 1 that are compressed with it
endif()
find_path(protozero protozero/pbf_reader.hpp REQUIRED)
find_package(Boost CONFIG REQUIRED) # headers

if(BF_YARP AND NOT CMAKE_CROSSCOMPILING AND NOT BF_WHEEL)
    find_package(YARP 3.5 QUIET COMPONENTS os sig dev HINTS ${BF_DEPS}/yarp/prefix)
endif()
if(YARP_FOUND)
    get_target_property(library YARP::YARP_os LOCATION)
    get_filename_component(BF_YARP_LIBRARIES ${library} DIRECTORY)
    get_filename_component(BF_YARP_PREFIX ${BF_YARP_LIBRARIES} DIRECTORY)
    set(BF_YARP_DATA ${BF_YARP_PREFIX}/share/yarp) # where YARP looks for its devices
    # GCC 12 misses two headers that YARP's used to include.
    set(BF_YARP_OPTIONS "SHELL:-include iterator" "SHELL:-include utility"
        $<$<CONFIG:Sanitize>:-fno-sanitize=vptr>) # YARP hides the typeinfo of what it lets others derive from
else()
    set(BF_YARP OFF)
endif()

if(BF_ROS1 AND NOT CMAKE_CROSSCOMPILING AND NOT BF_WHEEL)
    pkg_check_modules(roscpp QUIET IMPORTED_TARGET roscpp)
endif()
if(NOT roscpp_FOUND)
    set(BF_ROS1 OFF)
endif()

if(BF_ROS2 AND NOT CMAKE_CROSSCOMPILING AND NOT BF_WHEEL)
    string(REPLACE ":" ";" prefixes "$ENV{AMENT_PREFIX_PATH}")
    find_library(BF_RCL rcl PATHS ${prefixes} ${BF_DEPS}/ros2 PATH_SUFFIXES lib NO_DEFAULT_PATH)
endif()
if(BF_RCL)
    get_filename_component(BF_ROS2_LIBRARIES ${BF_RCL} DIRECTORY)
    get_filename_component(BF_ROS2_PREFIX ${BF_ROS2_LIBRARIES} DIRECTORY)
    # The packages' own CMake files name folders of the computer where the wheels were made.
    file(GLOB includes ${BF_ROS2_PREFIX}/include/*)
    set(libraries rcl rcutils rmw rosidl_runtime_c)
    foreach(package builtin_interfaces geometry_msgs lifecycle_msgs rcl_interfaces rosgraph_msgs sensor_msgs std_msgs std_srvs trajectory_msgs)
        list(APPEND libraries ${package}__rosidl_generator_c ${package}__rosidl_typesupport_c)
    endforeach()
    list(TRANSFORM libraries REPLACE "(.+)" "${BF_ROS2_LIBRARIES}/lib\\1.so")
    add_library(ROS2::rcl INTERFACE IMPORTED)
    target_include_directories(ROS2::rcl INTERFACE ${includes})
    target_link_libraries(ROS2::rcl INTERFACE ${libraries})
    target_link_options(ROS2::rcl INTERFACE LINKER:--allow-shlib-undefined)
else()
    set(BF_ROS2 OFF)
endif()
if(BF_SUNDIALS)
    find_package(SUNDIALS 6.4 REQUIRED)
endif()
if(BF_ROBOTS OR BF_FMI)
    find_package(tinyxml2 REQUIRED)
    # _FILE_OFFSET_BITS=64 is what processors of 64 bits have anyway; as an option it keeps precompiled headers out.
    set_target_properties(tinyxml2::tinyxml2 PROPERTIES INTERFACE_COMPILE_DEFINITIONS TINYXML2_IMPORT)
endif()
if(BF_FMI)
    pkg_check_modules(minizip REQUIRED IMPORTED_TARGET minizip)
    set_target_properties(PkgConfig::minizip PROPERTIES INTERFACE_COMPILE_OPTIONS "") # the same
endif()
if(BF_ROBOTS)
    find_package(pinocchio 4.1 REQUIRED)
    find_package(proxsuite REQUIRED COMPONENTS proxsuite)
    find_package(qpOASES 3.2 REQUIRED) # names files, no target
    add_library(qpOASES::qpOASES SHARED IMPORTED)
    set_target_properties(qpOASES::qpOASES PROPERTIES IMPORTED_LOCATION ${qpOASES_LIBRARY}
        INTERFACE_INCLUDE_DIRECTORIES ${qpOASES_INCLUDE_DIR})
    find_package(MuJoCo REQUIRED)
    find_package(assimp 6 REQUIRED)
endif()

if(BF_EVERYTHING AND NOT CMAKE_CROSSCOMPILING) # what only tests and benchmarks need
    find_package(GTest REQUIRED)
    find_package(benchmark REQUIRED)
    find_package(LibXml2 REQUIRED) # for iDynTree
    find_package(iDynTree 15 REQUIRED)

    # iDynTree's archives need std::ios_base_library_init(), which came with GCC 13.
    add_library(bf_gcc13_ios STATIC ${CMAKE_SOURCE_DIR}/cmake/gcc13_ios.cpp)
    set_property(TARGET iDynTree::idyntree-core APPEND PROPERTY INTERFACE_LINK_LIBRARIES bf_gcc13_ios)
endif()
