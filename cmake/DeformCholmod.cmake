# Where CHOLMOD of SuiteSparse is; Debian's package has no CMake file and no .pc.
find_path(DEFORM_CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse)
find_library(DEFORM_CHOLMOD_LIBRARY cholmod)
if(NOT DEFORM_CHOLMOD_INCLUDE OR NOT DEFORM_CHOLMOD_LIBRARY)
  message(FATAL_ERROR "solver_cholmod: CHOLMOD is not there; install libsuitesparse-dev "
    "(cmake/setup.sh cholmod), or configure with -DDEFORM_CHOLMOD=OFF")
endif()
