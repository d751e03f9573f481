# What `cpack` makes of an installation: the Debian packages libparianX.Y, libparian-dev and parian.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/packages)
set(CPACK_PACKAGE_VENDOR "The Parian authors")
set(PARIAN_MAINTAINER "The Parian authors <parian@localhost>" CACHE STRING "maintainer of the packages: NAME <ADDRESS>")
set(CPACK_PACKAGE_CONTACT ${PARIAN_MAINTAINER})
set(CPACK_RESOURCE_FILE_LICENSE ${CMAKE_CURRENT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL libparian-dev)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SOURCE parian)
set(CPACK_DEBIAN_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(PARIAN_ABI ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(PARIAN_OPENCL "ocl-icd-opencl-dev | opencl-dev, opencl-c-headers | opencl-headers")

set(CPACK_DEBIAN_LIBPARIAN-DEV_PACKAGE_NAME libparian-dev)
set(CPACK_DEBIAN_LIBPARIAN-DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBPARIAN-DEV_PACKAGE_DEPENDS "${PARIAN_OPENCL}")
set(CPACK_DEBIAN_LIBPARIAN-DEV_PACKAGE_SUGGESTS "parian, pkgconf")
set(CPACK_DEBIAN_LIBPARIAN-DEV_DESCRIPTION "translucent materials with the directional dipole, for building programs
Parian's library renders marble, skin, milk, wax and jade inside other
programs, with OpenCL contexts, queues and buffers that may be theirs.
.
This package has the headers for C and C++, the static library, and what
CMake and pkg-config need. The package parian has the documents.")

if(BUILD_SHARED_LIBS)
  list(APPEND CPACK_COMPONENTS_ALL libparian)
  set(CPACK_DEBIAN_LIBPARIAN_PACKAGE_NAME libparian${PARIAN_ABI})
  set(CPACK_DEBIAN_LIBPARIAN_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_LIBPARIAN_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
  set(CPACK_DEBIAN_LIBPARIAN_DESCRIPTION "translucent materials with the directional dipole, shared library
Parian's library renders marble, skin, milk, wax and jade inside other
programs, with OpenCL contexts, queues and buffers that may be theirs. The
kernels run on any OpenCL 1.2 device and, through PoCL, on plain CPUs.")
  # Which package has the library, for packages of programs that link it.
  file(WRITE ${PARIAN_GENERATED}/shlibs "libparian ${PARIAN_ABI} libparian${PARIAN_ABI} (>= ${PROJECT_VERSION})\n")
  file(WRITE ${PARIAN_GENERATED}/triggers "activate-noawait ldconfig\n")
  set(CPACK_DEBIAN_LIBPARIAN_PACKAGE_CONTROL_EXTRA ${PARIAN_GENERATED}/shlibs ${PARIAN_GENERATED}/triggers)
  string(PREPEND CPACK_DEBIAN_LIBPARIAN-DEV_PACKAGE_DEPENDS
    "libparian${PARIAN_ABI} (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}), ")
endif()

if(PARIAN_CLI)
  list(APPEND CPACK_COMPONENTS_ALL parian)
  set(CPACK_DEBIAN_PARIAN_PACKAGE_NAME parian)
  set(CPACK_DEBIAN_PARIAN_PACKAGE_SECTION graphics)
  set(CPACK_DEBIAN_PARIAN_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
  set(CPACK_DEBIAN_PARIAN_DESCRIPTION "translucent materials with the directional dipole, in OpenCL
Parian renders translucent materials (marble, skin, milk, wax, jade) from
meshes and scene files, on any OpenCL 1.2 device and, through PoCL, on plain
CPUs. It estimates its own error, stops at a target, and has an independent
reference to be held against.
.
This package has the command, its manual page, models, scenes and
documents.")
endif()

set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_SOURCE_DIR}/tools/packed.cmake)
include(CPack)
