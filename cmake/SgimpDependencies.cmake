# Every library as an imported target. What is missing is collected, so that one message names all of it.
set(SGIMP_MISSING "")

# sgimp_missing(what "Debian packages" "Spack packages")
macro(sgimp_missing what debian spack)
  list(APPEND SGIMP_MISSING "  ${what}: Debian ${debian} / Spack ${spack}")
endmacro()

find_package(MPI QUIET COMPONENTS Fortran)
if(NOT MPI_Fortran_FOUND)
  sgimp_missing("MPI for Fortran" "libopenmpi-dev openmpi-bin" "openmpi")
elseif(NOT MPI_Fortran_HAVE_F08_MODULE)
  sgimp_missing("module mpi_f08, built by this Fortran compiler" "libopenmpi-dev" "openmpi")
endif()

find_package(BLAS QUIET)
find_package(LAPACK QUIET)
if(NOT TARGET BLAS::BLAS OR NOT TARGET LAPACK::LAPACK)
  sgimp_missing("BLAS and LAPACK" "libopenblas-dev" "openblas")
endif()

find_package(HDF5 QUIET COMPONENTS C Fortran)
if(NOT TARGET hdf5::hdf5 OR NOT TARGET hdf5::hdf5_fortran)
  sgimp_missing("HDF5 with its Fortran interface" "libhdf5-dev" "hdf5+fortran")
endif()

find_path(FFTW3_INCLUDE_DIR fftw3.f03)
find_library(FFTW3_LIBRARY fftw3)
mark_as_advanced(FFTW3_INCLUDE_DIR FFTW3_LIBRARY)
if(FFTW3_INCLUDE_DIR AND FFTW3_LIBRARY)
  add_library(FFTW3::fftw3 UNKNOWN IMPORTED)
  # Not as a system directory: Fortran compilers look for INCLUDE files in -I directories only.
  set_target_properties(FFTW3::fftw3 PROPERTIES
    IMPORTED_LOCATION ${FFTW3_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${FFTW3_INCLUDE_DIR}
    IMPORTED_NO_SYSTEM ON)
else()
  sgimp_missing("FFTW 3" "libfftw3-dev" "fftw")
endif()

find_path(RANDOM123_INCLUDE_DIR Random123/philox.h)
mark_as_advanced(RANDOM123_INCLUDE_DIR)
if(RANDOM123_INCLUDE_DIR)
  add_library(Random123::Random123 INTERFACE IMPORTED)
  set_target_properties(Random123::Random123 PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES ${RANDOM123_INCLUDE_DIR})
else()
  sgimp_missing("Random123 headers" "librandom123-dev" "random123")
endif()

find_package(GSL QUIET)
if(NOT TARGET GSL::gsl)
  sgimp_missing("GNU Scientific Library" "libgsl-dev" "gsl")
endif()

# Comes with the compiler; without it `&solver threads` can only be 1.
find_package(OpenMP QUIET COMPONENTS Fortran)

if(SGIMP_MISSING)
  list(JOIN SGIMP_MISSING "\n" SGIMP_MISSING)
  message(FATAL_ERROR
    "Missing, with the packages that hold it:\n${SGIMP_MISSING}\n"
    "Libraries in unusual places are found through CMAKE_PREFIX_PATH.")
endif()

# One line for the provenance of results.
set(SGIMP_LIBRARIES "MPI standard ${MPI_Fortran_VERSION}, HDF5 ${HDF5_VERSION}, GSL ${GSL_VERSION}")
foreach(library IN LISTS LAPACK_LIBRARIES FFTW3_LIBRARY)
  cmake_path(GET library STEM stem)
  if(NOT stem MATCHES "^-" AND NOT SGIMP_LIBRARIES MATCHES "${stem}")
    string(APPEND SGIMP_LIBRARIES ", ${stem}")
  endif()
endforeach()
