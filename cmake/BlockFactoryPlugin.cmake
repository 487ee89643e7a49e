# bf_plugin(NAME SOURCES file... [LINK target...]): NAME.so, a shared library of blocks.
#
# It is put into BF_PLUGIN_DIRECTORY or, without that, where the project's libraries go; `bf` finds it there when
# the folder is in BLOCKFACTORY_PLUGIN_PATH. This file serves the project itself and whoever installs it.
function(bf_plugin name)
    cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
    set(map ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/plugin.map)
    add_library(${name} MODULE ${arg_SOURCES})
    target_link_libraries(${name} PRIVATE BlockFactory::core ${arg_LINK})
    target_link_options(${name} PRIVATE LINKER:--version-script=${map})
    set_target_properties(${name} PROPERTIES PREFIX "" CXX_EXTENSIONS OFF LINK_DEPENDS ${map})
    if(BF_PLUGIN_DIRECTORY)
        set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${BF_PLUGIN_DIRECTORY})
    endif()
endfunction()
