// Texts and numbers that the build puts inside the library (made by tools/embed.cmake).
#pragma once

namespace parian {

extern const char* const version;  ///< "MAJOR.MINOR.PATCH"
/// OpenCL C programs: what renders, what a device is asked before it is trusted, and what measures its peak.
extern const char *const render_sources, *const self_test_sources, *const bench_sources;

/// A line of the table of measured materials: RGB, in 1/mm; sigma_s is the reduced one where g is 0.
struct MeasuredRow {
  const char *name, *dataset;
  double sigma_s[3], sigma_a[3], g[3], ior;
};
extern const MeasuredRow measured_rows[];  ///< after the last one, one without a name

}  // namespace parian
