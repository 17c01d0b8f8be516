# Compiler flags live on one interface target; nothing is set globally.
set(SGIMP_ARCH "default" CACHE STRING
  "Instruction set: default (x86-64-v3 on x86-64), native, or any value of -march=")
add_library(sgimp_flags INTERFACE)
set(SGIMP_ARCH_FLAG "")
if(SGIMP_ARCH STREQUAL "default")
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    set(SGIMP_ARCH_FLAG -march=x86-64-v3)
  endif()
elseif(SGIMP_ARCH)
  set(SGIMP_ARCH_FLAG -march=${SGIMP_ARCH})
endif()
if(CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
  # No -ffast-math: comparisons with NaN stay honest. What is given up is errno, floating point traps and
  # the sign of zero, which lets the compiler turn max, min and merge into vector instructions.
  target_compile_options(sgimp_flags INTERFACE
    "$<$<COMPILE_LANGUAGE:Fortran>:-std=f2008;-fopenmp-simd>"
    # Equality of reals is asked for on purpose (sentinels, round trips); an interface can have an argument
    # that one implementation does not need.
    "$<$<COMPILE_LANGUAGE:Fortran>:-Wall;-Wextra;-pedantic;-Wimplicit-interface;-Wno-compare-reals;-Wno-unused-dummy-argument>"
    "$<$<AND:$<COMPILE_LANGUAGE:Fortran>,$<CONFIG:Release>>:${SGIMP_ARCH_FLAG};-fno-math-errno;-fno-trapping-math;-fno-signed-zeros>"
    "$<$<AND:$<COMPILE_LANGUAGE:Fortran>,$<CONFIG:Debug>>:-fcheck=all;-finit-real=snan;-ffpe-trap=invalid,zero,overflow;-fbacktrace>")
endif()
