# What `cmake --install` puts where: the library with headers and what CMake and pkg-config need, and of what else is
# built the command with its manual page, models and scenes. Nothing installed knows the prefix, so it may be moved.
# Components are what tools/packing.cmake makes packages of.
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME libparian-dev)
set(PARIAN_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/parian)
configure_package_config_file(tools/parian-config.cmake.in ${PARIAN_GENERATED}/parian-config.cmake
  INSTALL_DESTINATION ${PARIAN_PACKAGE} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PARIAN_GENERATED}/parian-config-version.cmake COMPATIBILITY SameMinorVersion)
install(TARGETS libparian EXPORT parian RUNTIME COMPONENT libparian LIBRARY COMPONENT libparian
  NAMELINK_COMPONENT libparian-dev)
install(EXPORT parian NAMESPACE parian:: FILE parian-targets.cmake DESTINATION ${PARIAN_PACKAGE})
install(FILES ${PARIAN_GENERATED}/parian-config.cmake ${PARIAN_GENERATED}/parian-config-version.cmake
  DESTINATION ${PARIAN_PACKAGE})
install(DIRECTORY host/include/parian DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
if(TARGET libparian-static)
  install(TARGETS libparian-static)
endif()

# For pkg-config: what a static library needs is said openly where there is no other.
set(PARIAN_PC_PREFIX ${CMAKE_INSTALL_PREFIX})
if(NOT IS_ABSOLUTE ${CMAKE_INSTALL_LIBDIR})
  file(RELATIVE_PATH PARIAN_PC_PREFIX /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
  string(REGEX REPLACE "^(.*[^/])/*$" "\${pcfiledir}/\\1" PARIAN_PC_PREFIX ${PARIAN_PC_PREFIX})
endif()
set(PARIAN_PC_LIBDIR "\${prefix}")
cmake_path(APPEND PARIAN_PC_LIBDIR ${CMAKE_INSTALL_LIBDIR})
set(PARIAN_PC_INCLUDEDIR "\${prefix}")
cmake_path(APPEND PARIAN_PC_INCLUDEDIR ${CMAKE_INSTALL_INCLUDEDIR})
list(TRANSFORM PARIAN_LANGUAGE_LIBRARIES PREPEND " -l" OUTPUT_VARIABLE PARIAN_PC_LIBS_PRIVATE)
list(JOIN PARIAN_PC_LIBS_PRIVATE "" PARIAN_PC_LIBS_PRIVATE)
if(NOT BUILD_SHARED_LIBS)
  set(PARIAN_PC_CFLAGS " -DPARIAN_STATIC")
  set(PARIAN_PC_LIBS ${PARIAN_PC_LIBS_PRIVATE})
endif()
configure_file(tools/parian.pc.in ${PARIAN_GENERATED}/parian.pc @ONLY)
install(FILES ${PARIAN_GENERATED}/parian.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

if(PARIAN_CLI)
  set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME parian)
endif()
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
