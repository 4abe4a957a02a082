# The report page: its types, and the page of a short run opened in a browser.
find_program(NPM npm)
if(NOT NPM)
  message(STATUS "npm not found: the report page is not tested")
  return()
endif()
add_test(NAME web_check COMMAND ${NPM} run --silent check WORKING_DIRECTORY ${CMAKE_SOURCE_DIR}/web)
set_tests_properties(web_check PROPERTIES LABELS web)

set(short_run ${CMAKE_CURRENT_BINARY_DIR}/web)
add_test(NAME web_short_run COMMAND topple run ${CMAKE_CURRENT_SOURCE_DIR}/data/short.toml -o ${short_run})
set_tests_properties(web_short_run PROPERTIES LABELS web FIXTURES_SETUP short_run TIMEOUT 120)
add_test(NAME web_report COMMAND ${NPM} test --silent WORKING_DIRECTORY ${CMAKE_SOURCE_DIR}/web)
set_tests_properties(
  web_report PROPERTIES LABELS web FIXTURES_REQUIRED short_run TIMEOUT 300
                        ENVIRONMENT "TOPPLE_REPORT=${short_run}/report.html")
