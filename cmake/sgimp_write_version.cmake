# cmake -D GIT=... -D SOURCE_DIR=... -D TEMPLATE=... -D OUTPUT=... -P sgimp_write_version.cmake
set(GIT_HASH unknown)
set(GIT_DIRTY .false.)
# A tarball unpacked inside some other repository must not take that one's hash.
if(GIT AND EXISTS ${SOURCE_DIR}/.git)
  execute_process(COMMAND ${GIT} -C ${SOURCE_DIR} rev-parse HEAD
    OUTPUT_VARIABLE hash ERROR_QUIET RESULT_VARIABLE status OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(status EQUAL 0)
    set(GIT_HASH ${hash})
    execute_process(COMMAND ${GIT} -C ${SOURCE_DIR} status --porcelain --untracked-files=no
      OUTPUT_VARIABLE changes ERROR_QUIET)
    if(changes)
      set(GIT_DIRTY .true.)
    endif()
  endif()
endif()
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
