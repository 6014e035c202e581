// What can stand next on a command line that is being typed, by the tree of commands itself.
#ifndef VANTAGE_CLIENT_CLI_COMPLETION_WORDS_H_
#define VANTAGE_CLIENT_CLI_COMPLETION_WORDS_H_

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace vantage::cli {

// A validator that says what it takes, for completion; nothing of it stands in the help.
CLI::Validator OneOf(const std::vector<std::string>& values);

struct Candidate {
  std::string word;
  std::string description;  // may be empty
};

struct Completions {
  enum class Paths { kNone, kFiles, kFolders };
  std::vector<Candidate> candidates;  // those that begin with what was typed
  Paths paths = Paths::kNone;         // which the shell adds by itself
};

// What is known elsewhere: the ids of a kind ('sessions', 'scans', 'plans', 'scanners', ...), in a
// session where they are of one, or 'servers', 'presets' and 'settings'. `options`: those of the
// whole program that were typed, with their values.
struct NamesWanted {
  std::string kind;
  std::string session;
  std::vector<std::string> options;
};
using FindNames = std::function<std::vector<Candidate>(const NamesWanted&)>;

// `words`: those behind the program's name up to the cursor; the last one, which may be empty, is
// being typed.
Completions CompleteWords(const CLI::App& program, const std::vector<std::string>& words,
                          const FindNames& find);

// All commands that do something, as 'scan push', with their apps, sorted.
std::vector<std::pair<std::string, const CLI::App*>> LeafCommands(const CLI::App& program);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_COMPLETION_WORDS_H_
