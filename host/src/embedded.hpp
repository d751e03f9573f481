// Texts that the build puts inside the library (made by tools/embed.cmake).
#pragma once

namespace parian {

extern const char* const version;          ///< "MAJOR.MINOR.PATCH"
extern const char* const kernel_sources;   ///< all kernels that render, one OpenCL C program
extern const char* const bench_sources;    ///< the kernel that measures a device's peak, a program of its own
extern const char* const materials_table;  ///< CSV of measured materials

}  // namespace parian
