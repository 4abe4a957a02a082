# Libraries behind the adapter, each optional: see docs/engines.md.
target_compile_definitions(topple_engines PRIVATE TOPPLE_VERSION="${PROJECT_VERSION}")
target_link_libraries(topple_engines PRIVATE Eigen3::Eigen)
if(TARGET SimTKsimbody)
  target_compile_definitions(topple_engines PRIVATE TOPPLE_WITH_SIMBODY)
  target_link_libraries(topple_engines PRIVATE SimTKsimbody)
  # Simbody 3.7's comparison operators are ambiguous in C++20
  set_source_files_properties(engines/simbody_system.cpp PROPERTIES COMPILE_OPTIONS -std=c++17)
endif()
if(TARGET mujoco::mujoco)
  target_compile_definitions(topple_engines PRIVATE TOPPLE_WITH_MUJOCO)
  target_link_libraries(topple_engines PRIVATE mujoco::mujoco)
endif()
