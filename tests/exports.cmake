# Exports of a short run, read by programs that are not ours.
if(NOT TARGET topple)
  return()
endif()
set(exports ${CMAKE_CURRENT_BINARY_DIR}/exports)
add_test(NAME export_run COMMAND topple run ${CMAKE_CURRENT_SOURCE_DIR}/data/short.toml -o ${exports} --no-report)
add_test(NAME export_files COMMAND topple export ${exports}/record.h5 --vtk --gltf --csv --json --frame-rate "10 Hz" -o ${exports}/files)
add_test(NAME export_adams COMMAND topple export ${exports}/model.json --adams -o ${exports}/files/model.adm)
set_tests_properties(export_run PROPERTIES LABELS unit FIXTURES_SETUP export_run TIMEOUT 120)
set_tests_properties(export_files PROPERTIES LABELS unit FIXTURES_REQUIRED export_run FIXTURES_SETUP export_files TIMEOUT 120)
set_tests_properties(export_adams PROPERTIES LABELS unit FIXTURES_REQUIRED export_run TIMEOUT 120)

# Debian's own, for which the packages are
find_program(TOPPLE_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
if(TOPPLE_PYTHON)
  execute_process(COMMAND ${TOPPLE_PYTHON} -c "import h5py, meshio" RESULT_VARIABLE missing OUTPUT_QUIET ERROR_QUIET)
else()
  set(missing 1)
endif()
if(missing)
  message(STATUS "python3 with h5py and meshio not found: exports are not read back by them")
else()
  add_test(NAME export_vtu COMMAND ${TOPPLE_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/python/check_vtu.py ${exports}/record.h5
                                   ${exports}/vtk_all)
  add_test(NAME export_vtu_files COMMAND topple export ${exports}/record.h5 --vtk -o ${exports}/vtk_all)
  set_tests_properties(export_vtu_files PROPERTIES LABELS unit FIXTURES_REQUIRED export_run FIXTURES_SETUP export_vtu TIMEOUT 120)
  set_tests_properties(export_vtu PROPERTIES LABELS unit FIXTURES_REQUIRED "export_run;export_vtu" TIMEOUT 120)
  add_test(NAME example_python COMMAND ${TOPPLE_PYTHON} ${PROJECT_SOURCE_DIR}/examples/python/read_record.py ${exports}/record.h5)
  set_tests_properties(example_python PROPERTIES LABELS unit FIXTURES_REQUIRED export_run TIMEOUT 60
                                                 PASS_REGULAR_EXPRESSION "farthest fall: [^,]+, [0-9.]+ m")
endif()
if(NPM)
  add_test(NAME export_gltf COMMAND ${NPM} run --silent test:gltf WORKING_DIRECTORY ${web})
  set_tests_properties(export_gltf PROPERTIES LABELS web FIXTURES_REQUIRED export_files TIMEOUT 120
                                              ENVIRONMENT "TOPPLE_EXPORTS=${exports}/files")
endif()

# the storehouse in Blender's importer
find_program(TOPPLE_BLENDER blender)
if(TOPPLE_BLENDER)
  set(storehouse ${CMAKE_CURRENT_BINARY_DIR}/exports_storehouse)
  add_test(NAME export_storehouse_run COMMAND topple run ${PROJECT_SOURCE_DIR}/examples/weida/plan.toml -o ${storehouse} --no-report)
  add_test(NAME export_storehouse COMMAND topple export ${storehouse}/record.h5 --gltf --json --frame-rate "10 Hz" -o ${storehouse})
  add_test(NAME export_blender COMMAND ${TOPPLE_BLENDER} -b --python-exit-code 1 --python
                                       ${CMAKE_CURRENT_SOURCE_DIR}/python/check_gltf_blender.py -- ${storehouse})
  set_tests_properties(export_storehouse_run PROPERTIES LABELS slow FIXTURES_SETUP export_storehouse_run TIMEOUT 600)
  set_tests_properties(export_storehouse PROPERTIES LABELS slow FIXTURES_REQUIRED export_storehouse_run FIXTURES_SETUP export_storehouse
                                                    TIMEOUT 120)
  set_tests_properties(export_blender PROPERTIES LABELS slow FIXTURES_REQUIRED export_storehouse TIMEOUT 300)
else()
  message(STATUS "blender not found: its import of glTF is not tested")
endif()
