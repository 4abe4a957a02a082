# What an installation holds beside the program and its pages (apps/CMakeLists.txt), and the Debian package:
# cpack -G DEB in the build folder. See docs/decisions/0055-debian-package.md.
set(docs share/doc/topple)
install(DIRECTORY docs/ DESTINATION ${docs}/docs)
install(DIRECTORY examples DESTINATION ${docs})
install(FILES README.md CHANGELOG.md CONTRIBUTING.md LICENSE cmake/package/copyright DESTINATION ${docs})
# what documents link to (tests/installed_test.sh)
install(FILES bench/README.md DESTINATION ${docs}/bench)
install(FILES tests/data/short.toml DESTINATION ${docs}/tests/data)
set(TOPPLE_MAINTAINER "The topple authors <topple@topple.invalid>" CACHE STRING "Who answers for the package")
find_program(GZIP gzip)
if(GZIP)
  # as Debian wants it; -n: the same bytes every time
  execute_process(COMMAND date -R -u -d ${TOPPLE_DATE} OUTPUT_VARIABLE when OUTPUT_STRIP_TRAILING_WHITESPACE)
  file(WRITE ${CMAKE_BINARY_DIR}/share/changelog "topple (${PROJECT_VERSION}) unstable; urgency=medium

  * What changed is in CHANGELOG.md beside this file.

 -- ${TOPPLE_MAINTAINER}  ${when}
")
  install(CODE "execute_process(COMMAND ${GZIP} -9nc ${CMAKE_BINARY_DIR}/share/changelog
                                OUTPUT_FILE ${CMAKE_BINARY_DIR}/share/changelog.gz COMMAND_ERROR_IS_FATAL ANY)
                execute_process(COMMAND ${GZIP} -9nc ${CMAKE_BINARY_DIR}/share/topple.1
                                OUTPUT_FILE ${CMAKE_BINARY_DIR}/share/topple.1.gz COMMAND_ERROR_IS_FATAL ANY)")
  install(FILES ${CMAKE_BINARY_DIR}/share/changelog.gz DESTINATION ${docs})
  install(FILES ${CMAKE_BINARY_DIR}/share/topple.1.gz DESTINATION share/man/man1)
else()
  install(FILES ${CMAKE_BINARY_DIR}/share/topple.1 DESTINATION share/man/man1)
endif()
install(FILES ${CMAKE_BINARY_DIR}/share/topple.bash DESTINATION share/bash-completion/completions RENAME topple)
install(FILES ${CMAKE_BINARY_DIR}/share/_topple DESTINATION share/zsh/vendor-completions)
install(FILES ${CMAKE_BINARY_DIR}/share/topple.fish DESTINATION share/fish/vendor_completions.d)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME topple)
set(CPACK_PACKAGE_VENDOR "The topple authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "show how a building comes down when it is blasted")
set(CPACK_PACKAGE_DESCRIPTION
    "topple reads a plan of a building of reinforced concrete and of its
charges, builds a multibody model with hinges of reinforced concrete, and
shows stability, collapse, debris and distances to neighbours, also for
fuzzy values.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${TOPPLE_MAINTAINER}")
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "chromium, xdg-utils, postgresql-client")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
include(CPack)
