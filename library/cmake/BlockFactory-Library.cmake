# For programs that load, run and generate models: BlockFactory::library.
include(${CMAKE_CURRENT_LIST_DIR}/BlockFactoryLibraryExports.cmake)
