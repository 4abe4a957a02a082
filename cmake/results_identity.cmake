# generated/apps/results_identity.h: a hash of all sources that decide results, so that two builds of one version are
# told apart (docs/decisions/0115-builds-are-told-apart.md). As a script it makes that file: cmake -DLIST= -DFROM= -DTO= -P.
if(CMAKE_SCRIPT_MODE_FILE)
  file(STRINGS ${LIST} sources)
  set(hashes "")
  foreach(source ${sources})
    file(SHA256 ${FROM}/${source} hash)
    string(APPEND hashes "${source} ${hash}\n")
  endforeach()
  string(SHA256 identity "${hashes}")
  string(SUBSTRING ${identity} 0 8 identity)
  file(CONFIGURE OUTPUT ${TO} CONTENT "#define TOPPLE_RESULTS_IDENTITY \"${identity}\"\n")
  return()
endif()

set(deciding "")
foreach(module base product material fem mbs engines nearfield collapse farfield uncertainty study)
  list(APPEND deciding ${PROJECT_SOURCE_DIR}/src/${module}/*)
endforeach()
file(GLOB_RECURSE deciding RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS ${deciding} ${PROJECT_SOURCE_DIR}/data/knowledge.json)
list(SORT deciding)
list(JOIN deciding "\n" lines)
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/apps/deciding_sources.txt CONTENT "${lines}\n")
list(TRANSFORM deciding PREPEND ${PROJECT_SOURCE_DIR}/ OUTPUT_VARIABLE deciding_paths)
add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/generated/apps/results_identity.h
                   COMMAND ${CMAKE_COMMAND} -DLIST=${CMAKE_BINARY_DIR}/generated/apps/deciding_sources.txt -DFROM=${PROJECT_SOURCE_DIR}
                           -DTO=${CMAKE_BINARY_DIR}/generated/apps/results_identity.h -P ${CMAKE_CURRENT_LIST_FILE}
                   COMMAND ${CMAKE_COMMAND} -E touch ${CMAKE_BINARY_DIR}/generated/apps/results_identity.h
                   DEPENDS ${deciding_paths} ${CMAKE_BINARY_DIR}/generated/apps/deciding_sources.txt ${CMAKE_CURRENT_LIST_FILE} VERBATIM)
