# Target BlockFactory::Core; makes include(BlockFactoryPlugin) available.
include_guard()
include(${CMAKE_CURRENT_LIST_DIR}/BlockFactoryCoreExports.cmake)
get_filename_component(folder ${CMAKE_CURRENT_LIST_DIR}/../../../share/BlockFactory/cmake ABSOLUTE)
list(APPEND CMAKE_MODULE_PATH ${folder})
if(NOT TARGET BlockFactory::BlockFactory)
    add_library(BlockFactory::BlockFactory INTERFACE IMPORTED)
endif()
