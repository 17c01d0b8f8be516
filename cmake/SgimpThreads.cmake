# sgimp_use_threads(target SHARED source.f90 ... CALLED source.f90 ...)
#
# Compiles the SHARED sources of `target`, whose loops threads share, with OpenMP, where there is OpenMP; no others,
# and the CALLED ones, whose procedures threads call, so that every call has local variables of its own.
function(sgimp_use_threads target)
  if(NOT OpenMP_Fortran_FOUND)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SHARED;CALLED")
  if(CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
    set_property(SOURCE ${arg_CALLED} TARGET_DIRECTORY ${target} APPEND PROPERTY COMPILE_OPTIONS -frecursive)
  endif()
  separate_arguments(flags NATIVE_COMMAND "${OpenMP_Fortran_FLAGS}")
  set_source_files_properties(${arg_SHARED} TARGET_DIRECTORY ${target} PROPERTIES COMPILE_OPTIONS "${flags}")
  target_link_options(${target} PUBLIC ${flags})
endfunction()
