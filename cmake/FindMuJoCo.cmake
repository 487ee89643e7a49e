# Target mujoco::mujoco over the wheel mujoco-core, found under MuJoCo_ROOT.
file(GLOB MuJoCo_LIBRARY ${MuJoCo_ROOT}/libmujoco.so*)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MuJoCo REQUIRED_VARS MuJoCo_LIBRARY MuJoCo_ROOT)
if(MuJoCo_FOUND AND NOT TARGET mujoco::mujoco)
    get_filename_component(soname ${MuJoCo_LIBRARY} NAME)
    add_library(mujoco::mujoco SHARED IMPORTED)
    set_target_properties(mujoco::mujoco PROPERTIES
        IMPORTED_LOCATION ${MuJoCo_LIBRARY}
        IMPORTED_SONAME ${soname}
        INTERFACE_INCLUDE_DIRECTORIES ${MuJoCo_ROOT}/include)
endif()
