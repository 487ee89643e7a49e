# The program BlockFactory::blockfactory-exists.
include_guard()
include(${CMAKE_CURRENT_LIST_DIR}/BlockFactory-Core.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/BlockFactoryToolsExports.cmake)
