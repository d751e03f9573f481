# A toolchain for CMake: MinGW-w64 on Debian, which builds the library for Windows on x86-64. The headers that it needs
# are Debian's own, beside those of Debian's C library, so they are linked to from a folder in the build; the import
# library for OpenCL.dll, which comes with a graphics driver, is made from the names in OpenCL's header.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(prefix x86_64-w64-mingw32)
set(CMAKE_C_COMPILER ${prefix}-gcc-posix)  # with C++'s threads
set(CMAKE_CXX_COMPILER ${prefix}-g++-posix)
set(CMAKE_RC_COMPILER ${prefix}-windres)

get_property(inside_check GLOBAL PROPERTY IN_TRY_COMPILE)
set(root ${CMAKE_BINARY_DIR}/windows)
if(NOT inside_check AND NOT EXISTS ${root}/lib/libOpenCL.dll.a)
  foreach(folder CL glm fmt)
    if(NOT EXISTS /usr/include/${folder})
      message(FATAL_ERROR "/usr/include/${folder} isn't there; install opencl-clhpp-headers, libglm-dev and libfmt-dev")
    endif()
    file(MAKE_DIRECTORY ${root}/include ${root}/lib/cmake)
    file(CREATE_LINK /usr/include/${folder} ${root}/include/${folder} SYMBOLIC)
  endforeach()
  foreach(target glm::glm fmt::fmt-header-only)
    string(REGEX REPLACE ":.*" "" name ${target})
    file(WRITE ${root}/lib/cmake/${name}/${name}-config.cmake "add_library(${target} INTERFACE IMPORTED)\n"
      "target_include_directories(${target} INTERFACE \${CMAKE_CURRENT_LIST_DIR}/../../../include)\n")
  endforeach()
  file(APPEND ${root}/lib/cmake/fmt/fmt-config.cmake
    "target_compile_definitions(fmt::fmt-header-only INTERFACE FMT_HEADER_ONLY)\n")

  file(READ /usr/include/CL/cl.h text)
  string(REGEX MATCHALL "CL_API_CALL[ \n]+cl[A-Za-z]+\\(" names "${text}")
  list(TRANSFORM names REPLACE "CL_API_CALL[ \n]+(cl[A-Za-z]+)\\(" "\\1\n")
  list(REMOVE_DUPLICATES names)
  file(WRITE ${root}/lib/opencl.def "LIBRARY OpenCL.dll\nEXPORTS\n" ${names})
  execute_process(COMMAND ${prefix}-dlltool -d ${root}/lib/opencl.def -l ${root}/lib/libOpenCL.dll.a
    COMMAND_ERROR_IS_FATAL ANY)
endif()

# Nothing of the system that compiles is taken for the one that is compiled for.
list(APPEND CMAKE_FIND_ROOT_PATH ${root})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
