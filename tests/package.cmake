# What is installed: links of the documents lead to what is there.
find_program(BASH bash)
if(TARGET topple AND BASH)
  add_test(NAME installed_links COMMAND ${BASH} ${CMAKE_CURRENT_SOURCE_DIR}/installed_test.sh ${CMAKE_BINARY_DIR} ${CMAKE_COMMAND}
                                        ${CMAKE_CURRENT_BINARY_DIR}/installed)
  set_tests_properties(installed_links PROPERTIES LABELS lint TIMEOUT 120)
endif()

# The Debian package: built, looked into, unpacked and used. Builds the whole package, hence slow.
find_program(DPKG_DEB dpkg-deb)
find_program(DPKG_SHLIBDEPS dpkg-shlibdeps)
if(TARGET topple AND DPKG_DEB AND DPKG_SHLIBDEPS)
  add_test(NAME package_deb COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/package_test.sh ${CMAKE_BINARY_DIR} ${CMAKE_CPACK_COMMAND}
                                    ${CMAKE_CURRENT_BINARY_DIR}/package)
  set_tests_properties(package_deb PROPERTIES LABELS slow TIMEOUT 600)
else()
  message(STATUS "dpkg-deb or dpkg-shlibdeps not found: the Debian package is not tested")
endif()
