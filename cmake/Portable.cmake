# bisector_portable(TARGET) links the objects of an executable once more, as portable/NAME of the build, to run from a
# folder of its own on other systems (scripts/bundle). Part of the target bisector_portable, and of no default build.
#
# libpng and zlib are linked statically and hidden: a graphics driver that needs newer ones must not meet these.
# DT_RPATH, unlike DT_RUNPATH, also counts for the libraries' own needs. oldest_symbols.cpp says what --wrap is for.

find_library(BISECTOR_STATIC_PNG NAMES libpng16.a libpng.a)
find_library(BISECTOR_STATIC_ZLIB NAMES libz.a)
mark_as_advanced(BISECTOR_STATIC_PNG BISECTOR_STATIC_ZLIB)

add_custom_target(bisector_portable)
if(BISECTOR_STATIC_PNG AND BISECTOR_STATIC_ZLIB)
  add_library(bisector_oldest_symbols OBJECT EXCLUDE_FROM_ALL ${PROJECT_SOURCE_DIR}/cmake/oldest_symbols.cpp)
endif()

function(bisector_portable target)
  if(NOT TARGET bisector_oldest_symbols)
    return()
  endif()
  get_target_property(name ${target} OUTPUT_NAME)
  if(NOT name)
    set(name ${target})
  endif()
  get_target_property(libraries ${target} LINK_LIBRARIES)
  set(portable ${target}_portable)
  add_executable(${portable} EXCLUDE_FROM_ALL $<TARGET_OBJECTS:${target}> $<TARGET_OBJECTS:bisector_oldest_symbols>)
  set_target_properties(${portable} PROPERTIES OUTPUT_NAME ${name} LINKER_LANGUAGE CXX BUILD_RPATH "\$ORIGIN/../lib"
                        RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/portable)
  target_link_options(${portable} PRIVATE LINKER:--disable-new-dtags,--as-needed,--exclude-libs,ALL,--wrap=hypot)
  target_link_libraries(${portable} PRIVATE
                        "-Wl,--whole-archive" ${BISECTOR_STATIC_PNG} ${BISECTOR_STATIC_ZLIB} "-Wl,--no-whole-archive"
                        ${libraries})
  add_dependencies(bisector_portable ${portable})
endfunction()
