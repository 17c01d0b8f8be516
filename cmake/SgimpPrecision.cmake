# sgimp_single_precision(target source.f90 ...)
#
# Adds to `target` a twin of each listed module that works in single precision: the same text, in which modules of
# the list have the suffix _single (where they are named in `module`, `end module` and `use`) and the working kind
# is sp instead of wp. Twins are written to the build tree when CMake runs, which it does again when a source changes;
# their lines have the numbers of the source. Each source must begin `module NAME` and hold one line
# `use sg_kinds, only: ..., wp` with wp as the last name.
function(sgimp_single_precision target)
  set(names "")
  foreach(source IN LISTS ARGN)
    cmake_path(GET source STEM name)
    list(APPEND names ${name})
  endforeach()
  list(JOIN names "|" names)
  foreach(source IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH source NORMALIZE)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
    cmake_path(GET source STEM name)
    file(READ ${source} text)
    string(REGEX MATCHALL "\n  use sg_kinds, only: ([a-z0-9]+, )*wp\n" kinds "${text}")
    list(LENGTH kinds count)
    if(NOT count EQUAL 1 OR NOT text MATCHES "\nmodule ${name}\n")
      message(FATAL_ERROR "${source}: no module ${name} with one line `use sg_kinds, only: ..., wp`")
    endif()
    string(REGEX REPLACE "(\n  use sg_kinds, only: ([a-z0-9]+, )*)wp\n" "\\1wp => sp\n" text "${text}")
    string(REGEX REPLACE "((module|use) (${names}))([,\n])" "\\1_single\\4" text "${text}")
    set(twin ${PROJECT_BINARY_DIR}/generated/${name}_single.f90)
    file(GENERATE OUTPUT ${twin} CONTENT "${text}") # leaves alone what has not changed
    target_sources(${target} PRIVATE ${twin})
  endforeach()
endfunction()
