# Fails if a source is not laid out as .clang-format asks: cmake -DCLANG_FORMAT=... -DROOT=... -P format.cmake
file(GLOB_RECURSE sources ${ROOT}/src/*.h ${ROOT}/src/*.cpp ${ROOT}/apps/*.h ${ROOT}/apps/*.cpp ${ROOT}/tests/*.h
     ${ROOT}/tests/*.cpp ${ROOT}/bench/*.h ${ROOT}/bench/*.cpp)
if(NOT sources)
  message(FATAL_ERROR "no sources below ${ROOT}")
endif()
execute_process(COMMAND ${CLANG_FORMAT} --style=file --dry-run -Werror ${sources} RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "run: clang-format -i on the files above")
endif()
