# Commands to build a plugin of blocks written against BlockFactory::Core.
include(GNUInstallDirs)

# register_blockfactory_block(BLOCK_NAME <b> PLUGIN_NAME <p> SOURCES <file>... HEADERS <file>...)
# Adds the files of one block to plugin <p>, before add_blockfactory_plugin(<p>). Files are those of the folder that
# calls this or, when it has none of that name, of the one that makes the plugin.
function(register_blockfactory_block)
    cmake_parse_arguments(arg "" "BLOCK_NAME;PLUGIN_NAME" "SOURCES;HEADERS" ${ARGN})
    if(NOT arg_BLOCK_NAME OR NOT arg_PLUGIN_NAME)
        message(FATAL_ERROR "register_blockfactory_block needs BLOCK_NAME and PLUGIN_NAME")
    endif()
    foreach(kind SOURCES HEADERS)
        foreach(file ${arg_${kind}})
            if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
                set(file ${CMAKE_CURRENT_SOURCE_DIR}/${file})
            endif()
            set_property(GLOBAL APPEND PROPERTY ${arg_PLUGIN_NAME}_${kind} ${file})
        endforeach()
    endforeach()
endfunction()

# add_blockfactory_plugin(<p> [EXTRA_SOURCES <file>...])
# The shared library lib<p>.so of all registered blocks. The file with the lines
# SHLIBPP_DEFINE_SHARED_SUBCLASS is one of the extra sources.
function(add_blockfactory_plugin name)
    cmake_parse_arguments(arg "" "" "EXTRA_SOURCES" ${ARGN})
    get_property(sources GLOBAL PROPERTY ${name}_SOURCES)
    get_property(headers GLOBAL PROPERTY ${name}_HEADERS)
    add_library(${name} SHARED ${sources} ${headers} ${arg_EXTRA_SOURCES})
    target_link_libraries(${name} PUBLIC BlockFactory::Core)
    # An installed plugin finds BlockFactory beside itself or where it was built against.
    set_target_properties(${name} PROPERTIES OUTPUT_NAME ${name} INSTALL_RPATH "$ORIGIN/.." INSTALL_RPATH_USE_LINK_PATH TRUE)
endfunction()

# install_blockfactory_plugin(<p>)
# To lib/blockfactory, headers to include/<p>/Block, targets in the export set <p>Export.
function(install_blockfactory_plugin name)
    install(TARGETS ${name} EXPORT ${name}Export
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/blockfactory
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/blockfactory
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR}/blockfactory
        PUBLIC_HEADER DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${name}/Block)
    get_property(headers GLOBAL PROPERTY ${name}_HEADERS)
    install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${name}/Block)
endfunction()
