# The report page: its types, the page with made-up data in a browser, and the page of a short run.
find_program(NPM npm)
if(NOT NPM)
  message(STATUS "npm not found: the report page is not tested")
  return()
endif()
set(web ${CMAKE_SOURCE_DIR}/web)
add_test(NAME web_check COMMAND ${NPM} run --silent check WORKING_DIRECTORY ${web})
add_test(NAME web_page COMMAND ${NPM} test --silent WORKING_DIRECTORY ${web})
set_tests_properties(web_check web_page PROPERTIES LABELS web TIMEOUT 300)
set_tests_properties(web_page PROPERTIES RESOURCE_LOCK chromium)

if(TARGET topple)
  set(short_run ${CMAKE_CURRENT_BINARY_DIR}/short_run)
  add_test(NAME web_short_run COMMAND topple run ${CMAKE_CURRENT_SOURCE_DIR}/data/short.toml -o ${short_run})
  set_tests_properties(web_short_run PROPERTIES LABELS web FIXTURES_SETUP short_run TIMEOUT 120)
  add_test(NAME web_report COMMAND ${NPM} test --silent WORKING_DIRECTORY ${web})
  set_tests_properties(
    web_report PROPERTIES LABELS web FIXTURES_REQUIRED short_run RESOURCE_LOCK chromium TIMEOUT 300
                          ENVIRONMENT "TOPPLE_REPORT=${short_run}/report.html")
endif()
