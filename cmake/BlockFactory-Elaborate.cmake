# For generated programs whose sizes are found at their start: BlockFactory::elaborate, ::yaml and what they are made of.
find_package(yaml-cpp QUIET)
if(yaml-cpp_FOUND)
    include(${CMAKE_CURRENT_LIST_DIR}/BlockFactoryElaborateExports.cmake)
endif()
