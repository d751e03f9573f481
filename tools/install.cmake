# What `cmake --install` puts where: the library with headers and a CMake package, and of what else is built the command
# with its manual page, models and scenes. Nothing installed knows the prefix, so it may be moved.
include(CMakePackageConfigHelpers)
set(PARIAN_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/parian)
configure_package_config_file(tools/parian-config.cmake.in ${PARIAN_GENERATED}/parian-config.cmake
  INSTALL_DESTINATION ${PARIAN_PACKAGE} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PARIAN_GENERATED}/parian-config-version.cmake COMPATIBILITY SameMinorVersion)
install(TARGETS libparian EXPORT parian)
install(EXPORT parian NAMESPACE parian:: FILE parian-targets.cmake DESTINATION ${PARIAN_PACKAGE})
install(FILES ${PARIAN_GENERATED}/parian-config.cmake ${PARIAN_GENERATED}/parian-config-version.cmake
  DESTINATION ${PARIAN_PACKAGE})
install(DIRECTORY host/include/parian DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES LICENSE README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR})

if(PARIAN_CLI)
  install(TARGETS parian-cli)
  install(TARGETS parian-pictures parian-rays LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/parian)
  install(DIRECTORY meshes DESTINATION ${CMAKE_INSTALL_DATADIR}/parian)
  # The manual page is what the command says of itself.
  add_custom_command(
    OUTPUT ${PARIAN_GENERATED}/parian.1
    COMMAND ${CMAKE_COMMAND} -DPARIAN=$<TARGET_FILE:parian-cli> -DOUTPUT=${PARIAN_GENERATED}/parian.1
            -P ${CMAKE_CURRENT_SOURCE_DIR}/tools/manual.cmake
    DEPENDS parian-cli tools/manual.cmake
    VERBATIM)
  add_custom_target(parian-manual ALL DEPENDS ${PARIAN_GENERATED}/parian.1)
  install(FILES ${PARIAN_GENERATED}/parian.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
endif()
