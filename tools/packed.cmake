# Makes of what is installed for packages what Debian's policy wants: the licence where it is looked for, manual pages
# and logs of changes compressed, Debian's own log, and all of it readable whatever the umask. Run by cpack before it
# packs.
cmake_minimum_required(VERSION 3.24)
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)  # or SOURCE_DATE_EPOCH
file(GLOB components LIST_DIRECTORIES true ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/*)
foreach(component IN LISTS components)
  get_filename_component(name ${component} NAME)
  if(CPACK_DEBIAN_LIBPARIAN_PACKAGE_NAME AND name STREQUAL libparian)
    set(name ${CPACK_DEBIAN_LIBPARIAN_PACKAGE_NAME})
  endif()
  set(documents ${component}/usr/share/doc/${name})
  file(REMOVE ${documents}/LICENSE)
  file(MAKE_DIRECTORY ${documents})
  file(COPY_FILE ${CPACK_RESOURCE_FILE_LICENSE} ${documents}/copyright)
  file(COPY_FILE ${CMAKE_CURRENT_LIST_DIR}/../CHANGELOG.md ${documents}/changelog)
  file(GLOB pages ${component}/usr/share/man/man1/*.1)
  file(WRITE ${documents}/changelog.Debian
    "parian (${CPACK_DEBIAN_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium\n\n"
    "  * Made by cpack; changelog.gz says what is new.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${now}\n")
  set(own ${documents}/copyright ${documents}/changelog ${documents}/changelog.Debian)
  file(CHMOD ${own} FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  execute_process(COMMAND gzip -9n ${pages} ${documents}/changelog ${documents}/changelog.Debian
    COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND find ${component} -type d -exec chmod 755 {} + COMMAND_ERROR_IS_FATAL ANY)
endforeach()
