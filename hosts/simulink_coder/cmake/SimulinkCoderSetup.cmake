# Target SimulinkCoder: the run-time headers that generated code includes, which come with BlockFactory.
if(NOT TARGET SimulinkCoder)
    add_library(SimulinkCoder INTERFACE)
    # In the sources, and where it is installed.
    foreach(folder ${CMAKE_CURRENT_LIST_DIR}/../include/simulink_runtime
                   ${CMAKE_CURRENT_LIST_DIR}/../simulink_runtime/extern/include)
        if(EXISTS ${folder}/tmwtypes.h)
            get_filename_component(folder ${folder} ABSOLUTE)
            target_include_directories(SimulinkCoder INTERFACE ${folder})
        endif()
    endforeach()
endif()
