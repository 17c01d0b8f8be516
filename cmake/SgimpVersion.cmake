# Module sg_version: written at configure time with what CMake knows, and completed at each build with the state
# of the git tree by sgimp_write_version.cmake, which leaves the file alone when nothing has changed.
set(SGIMP_COMPILER "${CMAKE_Fortran_COMPILER_ID} Fortran ${CMAKE_Fortran_COMPILER_VERSION}")
set(SGIMP_VERSION_SOURCE ${PROJECT_BINARY_DIR}/generated/sg_version.f90)
# As Fortran text over lines: 'abc'// &
foreach(name SGIMP_COMPILER_FLAGS SGIMP_LIBRARIES)
  string(REPLACE "'" "\"" rest "${${name}}")
  set(${name} "")
  while(rest MATCHES "^(................................................................................)(.+)$")
    string(APPEND ${name} "${CMAKE_MATCH_1}'// &\n    '")
    set(rest "${CMAKE_MATCH_2}")
  endwhile()
  string(APPEND ${name} "${rest}")
endforeach()
set(AT "@")
configure_file(src/base/sg_version.f90.in ${PROJECT_BINARY_DIR}/generated/sg_version.f90.half @ONLY)
find_package(Git QUIET)
add_custom_target(sgimp_version
  COMMAND ${CMAKE_COMMAND}
    -D GIT=${GIT_EXECUTABLE}
    -D SOURCE_DIR=${PROJECT_SOURCE_DIR}
    -D TEMPLATE=${PROJECT_BINARY_DIR}/generated/sg_version.f90.half
    -D OUTPUT=${SGIMP_VERSION_SOURCE}
    -P ${PROJECT_SOURCE_DIR}/cmake/sgimp_write_version.cmake
  BYPRODUCTS ${SGIMP_VERSION_SOURCE}
  COMMENT "Looking at the git state"
  VERBATIM)
target_sources(sgimp_core PRIVATE ${SGIMP_VERSION_SOURCE})
add_dependencies(sgimp_core sgimp_version)
