# The pages: their types, what needs no browser, and each page in a browser. A test file that hangs ends itself before
# its TIMEOUT (web/test/harness.mjs).
find_program(NPM npm)
find_program(NODE node)
if(NOT NPM OR NOT NODE)
  message(STATUS "node or npm not found: the pages are not tested")
  return()
endif()
set(web ${CMAKE_SOURCE_DIR}/web)
add_test(NAME web_check COMMAND ${NPM} run --silent check WORKING_DIRECTORY ${web})
set_tests_properties(web_check PROPERTIES LABELS web TIMEOUT 300)

# topple_web_test(NAME FILE [BROWSER] [LIMIT seconds] [FIXTURES names] [ENVIRONMENT NAME=VALUE ...])
# Tests with a browser run one at a time.
function(topple_web_test name file)
  cmake_parse_arguments(ARG "BROWSER" "LIMIT" "FIXTURES;ENVIRONMENT" ${ARGN})
  if(NOT ARG_LIMIT)
    set(ARG_LIMIT 360)
  endif()
  math(EXPR timeout "${ARG_LIMIT} + 60")
  add_test(NAME ${name} COMMAND ${NODE} --test test/${file} WORKING_DIRECTORY ${web})
  set_tests_properties(${name} PROPERTIES LABELS web TIMEOUT ${timeout}
                                          ENVIRONMENT "TOPPLE_WEB_LIMIT=${ARG_LIMIT};${ARG_ENVIRONMENT}")
  if(ARG_BROWSER)
    set_tests_properties(${name} PROPERTIES RESOURCE_LOCK chromium)
  endif()
  if(ARG_FIXTURES)
    set_tests_properties(${name} PROPERTIES FIXTURES_REQUIRED "${ARG_FIXTURES}")
  endif()
endfunction()

topple_web_test(web_data data.test.mjs)
topple_web_test(web_harness harness.test.mjs)
topple_web_test(web_report report.test.mjs BROWSER)
topple_web_test(web_german german.test.mjs BROWSER)
topple_web_test(web_compare compare.test.mjs BROWSER)
topple_web_test(web_study study.test.mjs BROWSER)
topple_web_test(web_steer steer.test.mjs BROWSER LIMIT 600)

if(TARGET topple)
  set(short_run ${CMAKE_CURRENT_BINARY_DIR}/short_run)
  add_test(NAME web_short_run COMMAND topple run ${CMAKE_CURRENT_SOURCE_DIR}/data/short.toml -o ${short_run})
  set_tests_properties(web_short_run PROPERTIES LABELS web FIXTURES_SETUP short_run TIMEOUT 120)
  topple_web_test(web_report_run report.test.mjs BROWSER FIXTURES short_run ENVIRONMENT TOPPLE_REPORT=${short_run}/report.html)
  topple_web_test(web_german_run german.test.mjs BROWSER FIXTURES short_run ENVIRONMENT TOPPLE_REPORT=${short_run}/report.html)
  set(short_fe ${CMAKE_CURRENT_BINARY_DIR}/short_fe)
  add_test(NAME web_short_fe COMMAND topple fe ${CMAKE_CURRENT_SOURCE_DIR}/data/short.toml --size "40 cm" -o ${short_fe})
  set_tests_properties(web_short_fe PROPERTIES LABELS web FIXTURES_SETUP short_fe TIMEOUT 180)
  topple_web_test(web_german_fe german.test.mjs BROWSER FIXTURES short_fe ENVIRONMENT TOPPLE_REPORT=${short_fe}/report.html)
  # a multibody model, a plan that does not stand, and a fuzzy one of which some samples do not and some are no plan
  file(READ ${CMAKE_CURRENT_SOURCE_DIR}/data/short.toml short)
  string(REPLACE "load = \"1 kN/m2\"" "load = \"90 kN/m2\"" overloaded "${short}")
  set(odd ${CMAKE_CURRENT_BINARY_DIR}/odd_pages)
  file(WRITE ${odd}/overloaded.toml "${overloaded}")
  file(WRITE ${odd}/failing.toml "${short}
[fuzzy]
storeys.load = { triangular = [\"1 kN/m2\", \"1 kN/m2\", \"90 kN/m2\"] }
stage.1.charge.1.position = { triangular = [\"0.7 m\", \"1.2 m\", \"1.4 m\"] }
stage.1.charge.1.destroyed_length = { triangular = [\"0.8 m\", \"1.2 m\", \"1.6 m\"] }
")
  add_test(NAME web_odd_model COMMAND topple mbs run ${CMAKE_SOURCE_DIR}/examples/mbs/slider_crank.json --duration "0.1 s" -o ${odd}/model)
  add_test(NAME web_odd_overloaded COMMAND topple run ${odd}/overloaded.toml -o ${odd}/overloaded)
  # another build's study is not gone on with
  add_test(NAME web_odd_study_clean COMMAND ${CMAKE_COMMAND} -E rm -rf ${odd}/study)
  add_test(NAME web_odd_study COMMAND topple study ${odd}/failing.toml --samples 40 --no-drivers -o ${odd}/study)
  set_tests_properties(web_odd_study PROPERTIES DEPENDS web_odd_study_clean)
  set_tests_properties(web_odd_model web_odd_overloaded web_odd_study_clean web_odd_study PROPERTIES LABELS web FIXTURES_SETUP odd_pages TIMEOUT 120)
  set_tests_properties(web_odd_overloaded PROPERTIES PASS_REGULAR_EXPRESSION "No equilibrium was found under dead load")
  topple_web_test(web_german_model german.test.mjs BROWSER FIXTURES odd_pages ENVIRONMENT TOPPLE_REPORT=${odd}/model/report.html)
  topple_web_test(web_german_overloaded german.test.mjs BROWSER FIXTURES odd_pages ENVIRONMENT TOPPLE_REPORT=${odd}/overloaded/report.html)
  topple_web_test(web_german_failing german.test.mjs BROWSER FIXTURES odd_pages ENVIRONMENT TOPPLE_STUDY=${odd}/study/study.html)
  find_program(PDFINFO pdfinfo)
  find_program(PDFTOTEXT pdftotext)
  if(PDFINFO AND PDFTOTEXT)
    topple_web_test(web_print_run print.test.mjs BROWSER FIXTURES short_run ENVIRONMENT TOPPLE_REPORT=${short_run}/report.html)
  else()
    message(STATUS "pdfinfo or pdftotext not found: printed pages are not tested (poppler-utils)")
  endif()
  # the storehouse, steered for minutes
  topple_web_test(web_steer_program steer_program.test.mjs BROWSER LIMIT 900 ENVIRONMENT TOPPLE=$<TARGET_FILE:topple>)
  set_tests_properties(web_steer_program PROPERTIES LABELS "web;slow")
  # a study of a model that is a program of its own
  set(short_study ${CMAKE_CURRENT_BINARY_DIR}/short_study)
  add_test(NAME web_short_study_clean COMMAND ${CMAKE_COMMAND} -E rm -rf ${short_study})
  add_test(NAME web_short_study COMMAND topple study ${CMAKE_CURRENT_SOURCE_DIR}/data/jump.toml --evaluator "$<TARGET_FILE:study_model> jump"
           --permissible "stands" --batch 50 -o ${short_study})
  set_tests_properties(web_short_study_clean PROPERTIES LABELS web FIXTURES_SETUP short_study TIMEOUT 60)
  set_tests_properties(web_short_study PROPERTIES LABELS web FIXTURES_SETUP short_study DEPENDS web_short_study_clean TIMEOUT 120)
  topple_web_test(web_study_run study.test.mjs BROWSER FIXTURES short_study ENVIRONMENT TOPPLE_STUDY=${short_study}/study.html)
  topple_web_test(web_german_study german.test.mjs BROWSER FIXTURES short_study ENVIRONMENT TOPPLE_STUDY=${short_study}/study.html)
  # of statistics, with every distribution
  set(random_study ${CMAKE_CURRENT_BINARY_DIR}/random_study)
  add_test(NAME web_random_study_clean COMMAND ${CMAKE_COMMAND} -E rm -rf ${random_study})
  add_test(NAME web_random_study COMMAND topple study ${CMAKE_CURRENT_SOURCE_DIR}/data/random.toml --evaluator "$<TARGET_FILE:study_model> jump"
           --permissible "p(falls) <= 0.5" --samples 300 -o ${random_study})
  set_tests_properties(web_random_study_clean PROPERTIES LABELS web FIXTURES_SETUP random_study TIMEOUT 60)
  set_tests_properties(web_random_study PROPERTIES LABELS web FIXTURES_SETUP random_study DEPENDS web_random_study_clean TIMEOUT 120)
  topple_web_test(web_german_random german.test.mjs BROWSER FIXTURES random_study ENVIRONMENT TOPPLE_STUDY=${random_study}/study.html)
endif()
