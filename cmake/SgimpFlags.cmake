# Compiler flags live on one interface target; nothing is set globally.
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Release or Debug" FORCE)
endif()
set(SGIMP_ARCH "native" CACHE STRING
  "Instruction set: native, that of this machine, or any value of -march=, for instance x86-64-v3; empty for no flag")
if(SGIMP_ARCH STREQUAL "default") # what build trees from before have in their cache
  set(SGIMP_ARCH "native")
endif()
set(SGIMP_ARCH_FLAG "")
if(SGIMP_ARCH)
  include(CheckFortranCompilerFlag)
  string(MAKE_C_IDENTIFIER "SGIMP_KNOWS_${SGIMP_ARCH}" known)
  check_fortran_compiler_flag(-march=${SGIMP_ARCH} ${known})
  if(${known})
    set(SGIMP_ARCH_FLAG -march=${SGIMP_ARCH})
  elseif(NOT SGIMP_ARCH STREQUAL "native") # which not every processor has
    message(FATAL_ERROR "The Fortran compiler does not know -march=${SGIMP_ARCH} (SGIMP_ARCH).")
  endif()
endif()
if(SGIMP_ARCH_FLAG AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # A node of the grid is eight numbers: one vector where the processor has such.
  list(APPEND SGIMP_ARCH_FLAG -mprefer-vector-width=512)
endif()
# What the program looks for when it starts, so that a processor without it gets a message and not an illegal
# instruction.
set(SGIMP_NEEDS "")
if(SGIMP_ARCH_FLAG AND CMAKE_BUILD_TYPE STREQUAL "Release")
  execute_process(COMMAND ${CMAKE_C_COMPILER} -march=${SGIMP_ARCH} -dM -E -x c /dev/null
    OUTPUT_VARIABLE macros RESULT_VARIABLE status ERROR_QUIET)
  if(NOT status EQUAL 0)
    message(WARNING "The C compiler does not know -march=${SGIMP_ARCH}: no check of the processor.")
  endif()
  foreach(feature AVX2 FMA AVX512F AVX512DQ AVX512BW AVX512VL)
    if(macros MATCHES "__${feature}__")
      list(APPEND SGIMP_NEEDS SGIMP_NEEDS_${feature})
    endif()
  endforeach()
endif()

set(SGIMP_FLAGS_ALWAYS "")
set(SGIMP_FLAGS_RELEASE "")
set(SGIMP_FLAGS_TRANSFER "") # of sg_transfer alone, in Release
set(SGIMP_FLAGS_DEBUG "")
if(CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
  set(SGIMP_FLAGS_ALWAYS -std=f2008 -fopenmp-simd)
  # Equality of reals is asked for on purpose (sentinels, round trips); an interface can have an argument
  # that one implementation does not need.
  set(SGIMP_FLAGS_WARNINGS -Wall -Wextra -pedantic -Wimplicit-interface -Wno-compare-reals
    -Wno-unused-dummy-argument)
  # CMake adds -O3. No -ffast-math: comparisons with NaN stay honest. What is given up is errno, floating point
  # traps and the sign of zero, which lets the compiler turn max, min and merge into vector instructions. GNU Fortran
  # then also takes the liberty that the Fortran standard gives, to order sums anew where no bracket forbids it.
  set(SGIMP_FLAGS_RELEASE ${SGIMP_ARCH_FLAG} -fno-math-errno -fno-trapping-math -fno-signed-zeros)
  # The transfers between points and nodes are written once for stencils of any number of columns and rows and called
  # with each. Inlined there, for which the usual limits are too low, the bounds of their loops are constants and nodes
  # stay in registers.
  set(SGIMP_FLAGS_TRANSFER -finline-limit=2000 --param=large-stack-frame=10000)
  set(SGIMP_FLAGS_DEBUG -fcheck=all -finit-real=snan -ffpe-trap=invalid,zero,overflow -fbacktrace)
endif()

add_library(sgimp_flags INTERFACE)
target_compile_options(sgimp_flags INTERFACE
  "$<$<COMPILE_LANGUAGE:Fortran>:${SGIMP_FLAGS_ALWAYS};${SGIMP_FLAGS_WARNINGS}>"
  "$<$<AND:$<COMPILE_LANGUAGE:Fortran>,$<CONFIG:Release>>:${SGIMP_FLAGS_RELEASE}>"
  "$<$<AND:$<COMPILE_LANGUAGE:Fortran>,$<CONFIG:Debug>>:${SGIMP_FLAGS_DEBUG}>")

# One line for the provenance of results: what bears on numbers.
string(TOUPPER "${CMAKE_BUILD_TYPE}" SGIMP_BUILD_TYPE_UPPER)
string(JOIN " " SGIMP_COMPILER_FLAGS
  ${CMAKE_Fortran_FLAGS} ${CMAKE_Fortran_FLAGS_${SGIMP_BUILD_TYPE_UPPER}}
  ${SGIMP_FLAGS_ALWAYS} ${SGIMP_FLAGS_${SGIMP_BUILD_TYPE_UPPER}})
if(CMAKE_BUILD_TYPE STREQUAL "Release")
  string(JOIN " " SGIMP_COMPILER_FLAGS ${SGIMP_COMPILER_FLAGS} ${SGIMP_FLAGS_TRANSFER})
endif()
