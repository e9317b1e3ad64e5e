# What is installed, by component: program, step and mpi (where they are built), c (the C interface at run time),
# development, and python, which a plain `cmake --install` leaves out.

set(BISECTOR_PYTHON_DIR lib/python3/dist-packages CACHE STRING "Folder below the prefix for the Python package")

install(TARGETS bisector EXPORT BisectorTargets COMPONENT development)
install(TARGETS bisector_c EXPORT BisectorTargets
        LIBRARY COMPONENT c NAMELINK_COMPONENT development)
install(DIRECTORY include/bisector DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
        FILES_MATCHING PATTERN "*.h")
install(FILES LICENSE packaging/debian/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/bisector COMPONENT program)
install(DIRECTORY python/bisector DESTINATION ${BISECTOR_PYTHON_DIR} COMPONENT python EXCLUDE_FROM_ALL
        FILES_MATCHING PATTERN "*.py" PATTERN py.typed PATTERN __pycache__ EXCLUDE)

# For CMake.
set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Bisector)
install(EXPORT BisectorTargets NAMESPACE Bisector:: DESTINATION ${config_folder} COMPONENT development)
get_target_property(bisector_type bisector TYPE)
configure_package_config_file(cmake/BisectorConfig.cmake.in ${PROJECT_BINARY_DIR}/BisectorConfig.cmake
                              INSTALL_DESTINATION ${config_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/BisectorConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/BisectorConfig.cmake ${PROJECT_BINARY_DIR}/BisectorConfigVersion.cmake
        DESTINATION ${config_folder} COMPONENT development)

# For pkg-config. The prefix follows from where the files lie. Who links the static library links what it uses, by
# --static; the shared one names that itself.
set(pc_folder ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH pc_prefix ${CMAKE_INSTALL_PREFIX}/${pc_folder} ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" pc_prefix "${pc_prefix}")
set(pc_private "")
if(bisector_type STREQUAL "STATIC_LIBRARY")
  set(pc_private "Requires.private: tbb fmt libpng mpfr gmp\nLibs.private: -lstdc++ -lm -l${CMAKE_DL_LIBS}\n")
endif()
foreach(name IN ITEMS bisector bisector_c)
  configure_file(cmake/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${pc_folder} COMPONENT development)
endforeach()
