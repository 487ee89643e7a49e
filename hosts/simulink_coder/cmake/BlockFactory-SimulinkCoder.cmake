# Target BlockFactory::SimulinkCoder; makes include(TargetFromGeneratedCode) available.
include_guard()
include(${CMAKE_CURRENT_LIST_DIR}/BlockFactory-Core.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/BlockFactorySimulinkCoderExports.cmake)
