# Debian packages; see docs/decisions/0001-dependencies.md
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(CLI11 REQUIRED)
find_package(TBB REQUIRED)
find_package(Threads REQUIRED)
find_package(HDF5 REQUIRED COMPONENTS C)
find_package(hwy REQUIRED)
find_package(Qhull REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(CAIRO REQUIRED IMPORTED_TARGET cairo)
find_package(Boost REQUIRED COMPONENTS headers)  # no library of it
find_package(SQLite3 REQUIRED)
find_package(PostgreSQL QUIET)  # studies on many machines; without it they run on one (docs/decisions/0027-study-store.md)
# CHOLMOD; Debian's package has no file for CMake
find_path(CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
add_library(SuiteSparse::cholmod UNKNOWN IMPORTED)
set_target_properties(SuiteSparse::cholmod PROPERTIES IMPORTED_LOCATION ${CHOLMOD_LIBRARY}
                                                      INTERFACE_INCLUDE_DIRECTORIES ${CHOLMOD_INCLUDE}
                                                      INTERFACE_LINK_LIBRARIES gomp)  # it is built with OpenMP
find_library(JEMALLOC_LIBRARY jemalloc)  # without it programs use the C library's allocator
# Other engines behind the adapter; topple runs without them (docs/engines.md).
find_package(Simbody QUIET)
find_package(mujoco QUIET)
if(TARGET mujoco::mujoco)
  # Debian's package names a folder of headers (qhull) that it neither needs nor depends on
  set_target_properties(mujoco::mujoco PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")
endif()
if(TOPPLE_TESTS)
  find_package(GTest REQUIRED)
endif()
if(TOPPLE_BENCH)
  find_package(benchmark REQUIRED)
endif()
