# What `cmake --install BUILD --prefix PREFIX` puts where:
#   bin/bf               the program
#   lib/libbf_core.so    the block API, one copy for the program and every plugin
#   lib/blockfactory/    plugins, which `bf` finds beside itself
#   lib/cmake/           find_package(BlockFactory)
#   lib/libbf_blocks.a   the standard blocks, for generated programs that make some of them at their start
#   lib/libblockfactory.so  BlockFactory::library, for programs that load, run and generate models
#   lib/libbf_elaborate.a, ... the compiler of models, for generated programs with sizes found at their start
#   include/bf/          headers
#
# A prefix may be moved, but stays on its machine: libraries from wheels and robot models are used where
# scripts/deps put them. For another processor lib/ holds all shared libraries, and `bf deploy` packs them.
include(CMakePackageConfigHelpers)
set(package lib/cmake/BlockFactory)

set_target_properties(bf_base PROPERTIES EXPORT_NAME base)
set_target_properties(bf_core PROPERTIES EXPORT_NAME core)
set_target_properties(bf_kernels PROPERTIES EXPORT_NAME kernels)
set_target_properties(bf_blocks PROPERTIES EXPORT_NAME blocks)
set(wheels ${BF_SITE}/cmeel.prefix/lib ${BF_SITE}/mujoco)
set(wheels_of_plugins ${wheels})
if(BF_WHEEL) # which is installed beside them, as SITE/blockfactory
    set(wheels $ORIGIN/../../cmeel.prefix/lib $ORIGIN/../../mujoco)
    set(wheels_of_plugins $ORIGIN/../../../cmeel.prefix/lib $ORIGIN/../../../mujoco)
endif()
# The build has the same folders. Without that CMake leaves room for the longer path of an installation, as an empty
# entry, by which the loader takes libraries from whatever folder the program is started in.
set_target_properties(bf PROPERTIES INSTALL_RPATH "$ORIGIN/../lib;${wheels}")
set_target_properties(bf PROPERTIES BUILD_WITH_INSTALL_RPATH ON)
set(plugins)
if(BF_ROBOTS)
    list(APPEND plugins WholeBodyToolbox WholeBodyCameras SharedMemory Udp)
    # What back ends of robots outside this tree implement.
    set_target_properties(bf_robot PROPERTIES EXPORT_NAME robot)
    install(TARGETS bf_robot EXPORT BlockFactory INCLUDES DESTINATION include)
    install(FILES toolbox/include/bf/toolbox/robot_device.hpp DESTINATION include/bf/toolbox)
    install(FILES physics/include/bf/physics/joint_control.hpp DESTINATION include/bf/physics)
    install(FILES middleware/include/bf/middleware/exchange.hpp middleware/include/bf/middleware/clock.hpp
        DESTINATION include/bf/middleware)
endif()
if(BF_FMI)
    list(APPEND plugins FMI)
endif()
foreach(plugin ${plugins})
    set_target_properties(${plugin} PROPERTIES INSTALL_RPATH "$ORIGIN/..;${wheels_of_plugins}" BUILD_WITH_INSTALL_RPATH ON)
    install(TARGETS ${plugin} LIBRARY DESTINATION lib/blockfactory)
endforeach()

# Blocks outside this tree must agree with core on the layout of Eigen's objects and on floating-point arithmetic.
target_compile_features(bf_core INTERFACE cxx_std_20)
target_compile_options(bf_core INTERFACE $<INSTALL_INTERFACE:-ffp-contract=off>)
target_compile_definitions(bf_core INTERFACE
    $<INSTALL_INTERFACE:EIGEN_MAX_ALIGN_BYTES=16> $<INSTALL_INTERFACE:EIGEN_MALLOC_ALREADY_ALIGNED=1>)

install(TARGETS bf_base bf_core bf_kernels bf_matlab bf_charts bf_blocks bf EXPORT BlockFactory
    RUNTIME DESTINATION bin LIBRARY DESTINATION lib ARCHIVE DESTINATION lib INCLUDES DESTINATION include)
install(TARGETS bf_program bf_elaborate bf_model bf_yaml EXPORT BlockFactoryElaborate
    ARCHIVE DESTINATION lib INCLUDES DESTINATION include)
foreach(library program elaborate model matlab yaml)
    set_target_properties(bf_${library} PROPERTIES EXPORT_NAME ${library})
endforeach()
install(EXPORT BlockFactoryElaborate NAMESPACE BlockFactory:: FILE BlockFactoryElaborateExports.cmake
    DESTINATION ${package})
install(FILES cmake/BlockFactory-Elaborate.cmake DESTINATION ${package})
install(DIRECTORY base/include/ core/include/ kernels/include/ program/include/ elaborate/include/ model/include/
    matlab/include/ formats/yaml/include/ DESTINATION include)
install(FILES blocks/include/bf/blocks/standard.hpp DESTINATION include/bf/blocks)
install(FILES formats/yaml/model.schema.json DESTINATION share/blockfactory)

install(EXPORT BlockFactory NAMESPACE BlockFactory:: FILE BlockFactoryExports.cmake DESTINATION ${package})
configure_package_config_file(cmake/BlockFactoryConfig.cmake.in BlockFactoryConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(BlockFactoryConfigVersion.cmake VERSION ${BF_API_VERSION} COMPATIBILITY AnyNewerVersion)
install(FILES cmake/bf_plugin.cmake
    ${CMAKE_CURRENT_BINARY_DIR}/BlockFactoryConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/BlockFactoryConfigVersion.cmake
    DESTINATION ${package})

if(CMAKE_CROSSCOMPILING)
    set(libraries ${CMAKE_SYSROOT}/lib/${CMAKE_LIBRARY_ARCHITECTURE} ${CMAKE_SYSROOT}/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE})
    install(CODE "
        set(OBJDUMP ${CMAKE_OBJDUMP})
        set(FROM ${wheels} ${libraries})
        set(TO \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/lib)
        set(FILES \${TO}/../bin/bf)
        foreach(plugin ${plugins})
            list(APPEND FILES \${TO}/blockfactory/\${plugin}.so)
        endforeach()")
    install(SCRIPT cmake/CopyLibraries.cmake)
endif()
