# find_package(SimulinkCoderRuntime): SimulinkCoderRuntime_ROOT_DIR stands for Matlab_ROOT_DIR where there is no MATLAB; the
# headers that generated code includes lie in its extern/include.
get_filename_component(SimulinkCoderRuntime_ROOT_DIR ${CMAKE_CURRENT_LIST_DIR}/../../../share/BlockFactory/simulink_runtime
    ABSOLUTE)
