# Debian packages of the components, by CPack (scripts/package, which gives the maintainer and Depends of the library).

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME bisector)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # it would be the first line of each package
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program c development python)
if(BISECTOR_STEP)
  list(APPEND CPACK_COMPONENTS_ALL step)
endif()
if(BISECTOR_MPI)
  list(APPEND CPACK_COMPONENTS_ALL mpi)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/FinishPackages.cmake)
set(CPACK_BISECTOR_SOURCE ${PROJECT_SOURCE_DIR})

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SOURCE bisector)
set(bisector_debian_version ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
string(CONCAT about
  "\nBisector makes triangle meshes of surfaces and tetrahedral meshes of solids"
  "\nby optimising certified centroidal Voronoi diagrams, finds the planes,"
  "\nquadrics and tori that a surface is made of, and reconstructs trees from"
  "\nlaser scans.\n\n")

# bisector_package(COMPONENT NAME SECTION SUMMARY LINES_OF_TEXT...)
macro(bisector_package component name section summary)
  set(lines ${ARGN})
  list(JOIN lines "\n" text)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}${about}${text}")
endmacro()

bisector_package(program bisector science "high-quality meshes of surfaces and solids"
  "This package has the program bisector. A GPU is used where its driver has"
  "Vulkan.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS libvulkan1)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "bisector-step, bisector-mpi")

bisector_package(step bisector-step science "STEP and IGES files of surfaces that bisector finds"
  "This package has the program bisector-step, which writes what bisector"
  "segment finds as faces for CAD systems.")
set(CPACK_DEBIAN_STEP_PACKAGE_RECOMMENDS bisector)

bisector_package(mpi bisector-mpi science "remeshing by many machines together"
  "This package has the program bisector-mpi, which mpirun bisector starts to"
  "divide the work on a surface among ranks of Open MPI.")
set(CPACK_DEBIAN_MPI_PACKAGE_DEPENDS "bisector (= ${bisector_debian_version}), openmpi-bin")

# CPack would have the library's scripts call ldconfig, where a trigger is asked for; so shlibs and Depends are not its
# business either.
bisector_package(c libbisector-c0 libs "mesh generator Bisector, C interface"
  "This package has the shared library libbisector_c. Tetrahedra of surfaces"
  "need the program bisector-tetgen of the package bisector.")
set(CPACK_DEBIAN_C_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_C_PACKAGE_RECOMMENDS libvulkan1)
set(CPACK_DEBIAN_C_PACKAGE_SUGGESTS bisector)
file(WRITE ${PROJECT_BINARY_DIR}/packages/shlibs
     "libbisector_c ${PROJECT_VERSION_MAJOR} libbisector-c${PROJECT_VERSION_MAJOR} (>= ${PROJECT_VERSION})\n")
file(WRITE ${PROJECT_BINARY_DIR}/packages/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_C_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/packages/shlibs
                                         ${PROJECT_BINARY_DIR}/packages/triggers)

bisector_package(development libbisector-dev libdevel "mesh generator Bisector, development files"
  "This package has the headers, the C++ library as a static one, and what"
  "links the C interface.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libbisector-c0 (= ${bisector_debian_version}), libtbb-dev, libfmt-dev, libpng-dev, libmpfr-dev, libgmp-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS bisector)

bisector_package(python python3-bisector python "mesh generator Bisector, Python interface"
  "This package has the module bisector, which takes files, NumPy arrays and"
  "meshes of trimesh, PyVista and meshio.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS bisector)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "libbisector-c0 (>= ${PROJECT_VERSION}), python3, python3-numpy")
foreach(script IN ITEMS postinst prerm)
  configure_file(packaging/debian/python3-bisector.${script} ${PROJECT_BINARY_DIR}/packages/${script} COPYONLY)
  list(APPEND CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/packages/${script})
endforeach()

include(CPack)
