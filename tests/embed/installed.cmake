# Installs this build, moves it, and uses what is there: one version everywhere, a manual page, a scene to render. Run
# by ctest: cmake -DSOURCE=… -DBUILD=… -DWORK=… -DVERSION=… -DBIN=… -DDATA=… -DMAN=… -DINCLUDE=… -P …
cmake_minimum_required(VERSION 3.24)

file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first OUTPUT_QUIET
  COMMAND_ERROR_IS_FATAL ANY)
set(prefix "${WORK}/moved away")
file(RENAME ${WORK}/first ${prefix})
set(command "${prefix}/${BIN}/parian")

execute_process(COMMAND ${command} --version OUTPUT_VARIABLE version COMMAND_ERROR_IS_FATAL ANY)
if(NOT version STREQUAL "parian ${VERSION}\n")
  message(FATAL_ERROR "parian --version says ${version}, the project ${VERSION}")
endif()
file(READ "${SOURCE}/CHANGELOG.md" changes)
if(NOT changes MATCHES "\n## \\[([0-9][^]]*)\\]" OR NOT CMAKE_MATCH_1 STREQUAL VERSION)
  message(FATAL_ERROR "CHANGELOG.md is about ${CMAKE_MATCH_1}, the project is ${VERSION}")
endif()
file(READ "${prefix}/${MAN}/man1/parian.1" manual)
foreach(text ".TH PARIAN 1 \"\" \"parian ${VERSION}\"" ".SH PARIAN render" "\\-\\-layer\\-size")
  string(FIND "${manual}" "${text}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "the manual page lacks ${text}")
  endif()
endforeach()

# An embedder's header needs OpenCL's and the standard's.
file(STRINGS "${prefix}/${INCLUDE}/parian/parian.h" includes REGEX "^ *# *include")
if(NOT includes STREQUAL "#include <CL/cl.h>;#include <stddef.h>;#include <stdint.h>")
  message(FATAL_ERROR "parian.h has ${includes}")
endif()

execute_process(
  COMMAND ${command} render "${prefix}/${DATA}/parian/meshes/scenes/figure.toml" --size 48x48 --frames 1 --layer-size 64
          -o ${WORK}/figure.png --quiet
  COMMAND_ERROR_IS_FATAL ANY)
file(SIZE ${WORK}/figure.png size)
if(size LESS 500)
  message(FATAL_ERROR "figure.png has ${size} bytes")
endif()
