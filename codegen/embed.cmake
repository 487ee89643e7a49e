# Writes OUTPUT: {"bf/kernels/view.hpp", "..."sv}, for every file of TEXTS.
set(content "")
foreach(file ${TEXTS})
    file(READ ${file} text)
    string(REGEX REPLACE ".*/(bf/[^/]+/[^/]+)$" "\\1" name ${file})
    # String literals are limited to 64 KiB by the standard, so each line is a literal; GCC joins them.
    set(rows "")
    string(LENGTH "${text}" length)
    set(at 0)
    while(at LESS length)
        string(SUBSTRING "${text}" ${at} 8000 part)
        string(APPEND rows "R\"~~~(${part})~~~\"\n")
        math(EXPR at "${at} + 8000")
    endwhile()
    string(APPEND content "{\"${name}\",\n${rows}\"\"sv},\n") # sv: no compiler counts the characters one by one
endforeach()
file(WRITE ${OUTPUT} "${content}")
