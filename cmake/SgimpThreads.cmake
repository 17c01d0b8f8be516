# sgimp_use_threads(target source.f90 ...)
#
# Compiles these sources of `target`, and no others, with OpenMP, where there is OpenMP.
function(sgimp_use_threads target)
  if(NOT OpenMP_Fortran_FOUND)
    return()
  endif()
  separate_arguments(flags NATIVE_COMMAND "${OpenMP_Fortran_FLAGS}")
  set_source_files_properties(${ARGN} TARGET_DIRECTORY ${target} PROPERTIES COMPILE_OPTIONS "${flags}")
  target_link_options(${target} PUBLIC ${flags})
endfunction()
