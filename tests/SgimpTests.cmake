# How tests are added.

set(SGIMP_PF_TO_FORTRAN ${CMAKE_CURRENT_SOURCE_DIR}/support/pf_to_fortran.py)

# What a test needs to run MPI programs wherever it is started: as root in a container, on fewer cores than
# ranks, beside other tests (so not bound to the first cores). The PRTE names are those of Open MPI 5.
set(SGIMP_TEST_ENVIRONMENT
  OMPI_ALLOW_RUN_AS_ROOT=1
  OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  OMPI_MCA_rmaps_base_oversubscribe=1
  OMPI_MCA_hwloc_base_binding_policy=none
  OMPI_MCA_mpi_yield_when_idle=1
  PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
  PRTE_MCA_hwloc_default_binding_policy=none
  OPENBLAS_NUM_THREADS=1
  OMP_NUM_THREADS=1
  OMP_WAIT_POLICY=passive)

# _sgimp_set_test_properties(NAME label ranks timeout)
function(_sgimp_set_test_properties name label ranks timeout)
  set_tests_properties(${name} PROPERTIES
    LABELS "${label}"
    TIMEOUT ${timeout}
    PROCESSORS ${ranks}
    ENVIRONMENT "${SGIMP_TEST_ENVIRONMENT}")
endfunction()

# add_sgimp_unit_test(NAME file.pf ... [MPI_RANKS n] [LABEL label] [TIMEOUT seconds] [LINK target ...])
#
# One test program from .pf files, linked to the library of the project. With MPI_RANKS it runs under mpirun
# with n ranks, n being the largest npes in the files; its label is then mpi, else unit.
function(add_sgimp_unit_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "MPI_RANKS;LABEL;TIMEOUT" "LINK")
  set(files ${arg_UNPARSED_ARGUMENTS})
  if(NOT files)
    message(FATAL_ERROR "add_sgimp_unit_test(${name}): no .pf files")
  endif()
  if(NOT DEFINED arg_LABEL)
    if(arg_MPI_RANKS)
      set(arg_LABEL mpi)
    else()
      set(arg_LABEL unit)
    endif()
  endif()
  if(NOT DEFINED arg_TIMEOUT)
    # A failed assert on one rank may leave the others waiting in a collective for ever.
    set(arg_TIMEOUT 120)
  endif()
  set(link sgimp_core ${arg_LINK})
  if(PFUNIT_FOUND)
    set(max_pes "")
    if(arg_MPI_RANKS)
      set(max_pes MAX_PES ${arg_MPI_RANKS})
    endif()
    add_pfunit_ctest(${name} TEST_SOURCES ${files} LINK_LIBRARIES ${link} ${max_pes})
    # Its generated code is not held to our warnings and line length.
    target_compile_options(${name} PRIVATE $<$<COMPILE_LANG_AND_ID:Fortran,GNU>:-w;-ffree-line-length-none>)
  else()
    _sgimp_add_own_unit_test(${name} "${files}" "${arg_MPI_RANKS}" "${link}")
  endif()
  if(NOT arg_MPI_RANKS)
    set(arg_MPI_RANKS 1)
  endif()
  _sgimp_set_test_properties(${name} ${arg_LABEL} ${arg_MPI_RANKS} ${arg_TIMEOUT})
endfunction()

# The program of a suite with our own runner; `ranks` is empty without MPI.
function(_sgimp_add_own_program name files ranks link)
  set(runner sgimp_funit)
  set(options "")
  if(ranks)
    set(runner sgimp_pfunit)
    set(options --mpi-ranks ${ranks})
  endif()
  set(directory ${CMAKE_CURRENT_BINARY_DIR}/${name}.dir)
  file(MAKE_DIRECTORY ${directory})
  set(sources "")
  foreach(file IN LISTS files)
    cmake_path(ABSOLUTE_PATH file OUTPUT_VARIABLE source)
    cmake_path(GET file STEM stem)
    add_custom_command(OUTPUT ${directory}/${stem}.F90
      COMMAND ${Python3_EXECUTABLE} ${SGIMP_PF_TO_FORTRAN} suite ${source} ${directory}/${stem}.F90 ${options}
      DEPENDS ${source} ${SGIMP_PF_TO_FORTRAN}
      COMMENT "Translating ${file}"
      VERBATIM)
    list(APPEND sources ${directory}/${stem}.F90)
  endforeach()
  set(driver ${directory}/${name}_driver.F90)
  # The list of files is part of the command, so a change of it makes the driver anew.
  add_custom_command(OUTPUT ${driver}
    COMMAND ${Python3_EXECUTABLE} ${SGIMP_PF_TO_FORTRAN} driver ${driver} ${files} ${options}
    DEPENDS ${SGIMP_PF_TO_FORTRAN}
    VERBATIM)
  add_executable(${name} ${sources} ${driver})
  target_link_libraries(${name} PRIVATE ${runner} ${link})
  target_compile_options(${name} PRIVATE $<$<COMPILE_LANG_AND_ID:Fortran,GNU>:-ffree-line-length-none>)
  set_target_properties(${name} PROPERTIES Fortran_MODULE_DIRECTORY ${directory}/modules)
endfunction()

function(_sgimp_add_own_unit_test name files ranks link)
  _sgimp_add_own_program(${name} "${files}" "${ranks}" "${link}")
  if(ranks)
    add_test(NAME ${name}
      COMMAND ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG} ${ranks} ${MPIEXEC_PREFLAGS} $<TARGET_FILE:${name}>)
  else()
    add_test(NAME ${name} COMMAND ${name})
  endif()
endfunction()

# add_sgimp_test(NAME LABEL label [TIMEOUT seconds] [RANKS n] COMMAND command ...)
#
# Any other test: a script, or a program that says by its exit code whether all is well. It gets the same
# environment; it starts mpirun itself (${MPIEXEC_EXECUTABLE}); RANKS says how many cores it keeps busy.
function(add_sgimp_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "LABEL;TIMEOUT;RANKS" "COMMAND")
  if(NOT arg_LABEL OR NOT arg_COMMAND)
    message(FATAL_ERROR "add_sgimp_test(${name}): LABEL and COMMAND are needed")
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  if(NOT arg_RANKS)
    set(arg_RANKS 1)
  endif()
  add_test(NAME ${name} COMMAND ${arg_COMMAND})
  _sgimp_set_test_properties(${name} ${arg_LABEL} ${arg_RANKS} ${arg_TIMEOUT})
endfunction()
