# bisector_sealed_object(VARIABLE OBJECTS...) sets VARIABLE to one object file that has the code of all OBJECTS and in
# which only what is exported remains global.
#
# A library of the objects as they are would also offer its instances of templates and inline functions, of which the
# linker keeps one for the whole program: a user's, compiled with other flags and perhaps rounding otherwise, could take
# the place of the library's. The descriptions of classes stay global, so that exceptions are recognised.
function(bisector_sealed_object variable)
  set(sealed ${PROJECT_BINARY_DIR}/bisector${CMAKE_CXX_OUTPUT_EXTENSION})
  set(list_mergeable "${CMAKE_NM} --defined-only --format=posix ${sealed} |
                      awk '$2 ~ /[VWu]/ && $1 !~ /^_ZT[ISV]N?8bisector/ { print $1 }' >${sealed}.mergeable")
  string(REGEX REPLACE "[ \n]+" " " list_mergeable "${list_mergeable}")
  add_custom_command(
    OUTPUT ${sealed}
    BYPRODUCTS ${sealed}.mergeable
    COMMAND ${CMAKE_LINKER} -r --force-group-allocation -o ${sealed} ${ARGN}
    COMMAND sh -c ${list_mergeable}
    COMMAND ${CMAKE_OBJCOPY} --localize-hidden --localize-symbols=${sealed}.mergeable ${sealed}
    DEPENDS ${ARGN}
    COMMENT "Sealing the library"
    COMMAND_EXPAND_LISTS
    VERBATIM)
  set(${variable} ${sealed} PARENT_SCOPE)
endfunction()
