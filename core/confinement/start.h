// What a process and the reader that it starts agree on.
#ifndef VANTAGE_CORE_CONFINEMENT_START_H_
#define VANTAGE_CORE_CONFINEMENT_START_H_

#include <cstddef>

namespace vantage::confinement {

// The first argument of a program that is executed to be a reader. Its name, the parent's process,
// and bytes of memory, seconds of a processor and bytes of the file follow.
inline constexpr char kReaderArgument[] = "--confined-reader";
inline constexpr int kReaderArguments = 7;

// Descriptors of a reader: questions, each a length (u32) and so many bytes; the answers; the file.
// There is no standard error: 2 is the file, too, which cannot be written to.
inline constexpr int kQuestions = 0;
inline constexpr int kAnswers = 1;
inline constexpr int kFile = 3;

inline constexpr size_t kMaxQuestionBytes = 1 << 16;

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_START_H_
