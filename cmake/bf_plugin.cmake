# bf_plugin(NAME SOURCES file... [LINK target...]): NAME.so, a shared library of blocks, and NAME_static, the same as an
# archive for generated programs that are configured with -DLINK_PLUGINS=ON.
#
# It is put into BF_PLUGIN_DIRECTORY or, without that, where the project's libraries go; `bf` finds it there when
# the folder is in BLOCKFACTORY_PLUGIN_PATH. This file serves the project itself and whoever installs it.
function(bf_plugin name)
    cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
    add_library(${name} MODULE ${arg_SOURCES})
    target_link_libraries(${name} PRIVATE BlockFactory::core ${arg_LINK})
    # Two plugins may hold different things of one name, and a plugin can be unloaded.
    target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
    target_link_options(${name} PRIVATE LINKER:--exclude-libs,ALL)
    set_target_properties(${name} PROPERTIES PREFIX "" CXX_EXTENSIONS OFF)
    if(BF_PLUGIN_DIRECTORY)
        set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${BF_PLUGIN_DIRECTORY})
    endif()

    add_library(${name}_static STATIC EXCLUDE_FROM_ALL $<TARGET_OBJECTS:${name}>)
    target_link_libraries(${name}_static INTERFACE BlockFactory::core ${arg_LINK})
    set_target_properties(${name}_static PROPERTIES OUTPUT_NAME ${name} LINKER_LANGUAGE CXX)
    # In one program the entries of several plugins need names of their own.
    string(MAKE_C_IDENTIFIER bf_plugin_v1_${name} entry)
    add_custom_command(TARGET ${name}_static POST_BUILD VERBATIM
        COMMAND ${CMAKE_OBJCOPY} --redefine-sym bf_plugin_v1=${entry} $<TARGET_FILE:${name}_static>)
endfunction()
