// Eigen's types lie in memory as the compiler's flags have it: with AVX it aligns them to 32 bytes.
// A program that uses the installed library is compiled with flags of its own, so the alignment
// that the library was made with is what its CMake target demands of them
// (installed_library.cmake).
#include <Eigen/Core>

static_assert(EIGEN_MAX_ALIGN_BYTES == 16,
              "the library would be installed with another layout than its headers ask for");
