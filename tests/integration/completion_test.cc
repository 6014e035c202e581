// The tree of commands: what shells complete of it, and what every command can do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "tests/integration/answers.h"

namespace vantage::integration {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSubsetOf;
using ::testing::Not;

struct Command {
  std::string name;
  std::string words;
  std::set<std::string> options;
};

std::vector<Command> AllCommands() {
  std::vector<Command> all;
  const Finished told = RunProgram({VANTAGE_BINARY, "completion", "commands"});
  EXPECT_EQ(told.exit_code, 0) << told.error;
  for (const auto line : absl::StrSplit(told.out, '\n', absl::SkipEmpty())) {
    const std::vector<std::string> parts = absl::StrSplit(line, '\t');
    all.push_back({parts[0], parts[1], absl::StrSplit(parts[2], ' ', absl::SkipEmpty())});
  }
  return all;
}

TEST(CommandTree, EveryCommandAnswersInJsonToo) {
  // And why not.
  const std::map<std::string, std::string> without = {
      {"completion", "prints a script for a shell"}};
  size_t with = 0;
  for (const Command& command : AllCommands()) {
    if (without.count(command.name) > 0) {
      EXPECT_THAT(command.options, Not(Contains("--json"))) << command.name;
      continue;
    }
    EXPECT_THAT(command.options, Contains("--json")) << command.name;
    ++with;
  }
  EXPECT_GE(with, 44u);
}

TEST(CommandTree, EveryCommandExplainsItselfWithAnExample) {
  for (const Command& command : AllCommands()) {
    std::vector<std::string> arguments = {VANTAGE_BINARY};
    for (const auto word : absl::StrSplit(command.name, ' ')) arguments.emplace_back(word);
    arguments.emplace_back("--help");
    const Finished finished = RunProgram(arguments);
    EXPECT_EQ(finished.exit_code, 0) << command.name;
    EXPECT_THAT(finished.out, HasSubstr("Examples:\n")) << command.name;
    EXPECT_THAT(finished.out, Not(HasSubstr("\033"))) << command.name;
    EXPECT_FALSE(command.words.empty()) << command.name;
  }
}

// What a shell offers for `typed`, by its own mechanism, a word a line.
class Shells : public ::testing::Test {
 protected:
  Shells() {
    for (const char* shell : {"bash", "zsh", "fish"}) {
      const Finished script = RunProgram({VANTAGE_BINARY, "completion", shell});
      EXPECT_EQ(script.exit_code, 0) << script.error;
      std::ofstream(Script(shell)) << script.out;
    }
    setenv("PATH",
           absl::StrCat(std::filesystem::path(VANTAGE_BINARY).parent_path().string(), ":",
                        getenv("PATH"))
               .c_str(),
           1);
  }

  std::string Script(const std::string& shell) const { return scratch_.File(shell); }

  // `words`: behind 'vantage'.
  std::vector<std::string> Bash(const std::vector<std::string>& words) const {
    std::string line = "vantage";
    for (const std::string& word : words) absl::StrAppend(&line, " '", word, "'");
    return Lines(RunProgram({"/usr/bin/env", "bash", "-c",
                             absl::StrCat("source ", Script("bash"), "; COMP_WORDS=(", line,
                                          "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _vantage; "
                                          "printf '%s\\n' \"${COMPREPLY[@]}\"")}));
  }

  static bool Has(const char* shell) {
    return RunProgram({"/usr/bin/env", "sh", "-c", absl::StrCat("command -v ", shell)}).exit_code ==
           0;
  }

  static std::vector<std::string> Lines(const Finished& finished) {
    EXPECT_EQ(finished.exit_code, 0) << finished.error;
    EXPECT_EQ(finished.error, "");
    return absl::StrSplit(finished.out, '\n', absl::SkipEmpty());
  }

  ScratchFolder scratch_;
};

TEST_F(Shells, BashCompletesCommandsOptionsAndNamesOnTheServer) {
  EXPECT_THAT(Bash({"pl"}), ::testing::UnorderedElementsAre("plan", "plans"));
  EXPECT_THAT(Bash({"scan", "p"}), ::testing::ElementsAre("push"));
  EXPECT_THAT(Bash({"plan", "flat", "--ran"}), ::testing::ElementsAre("--rank"));
  EXPECT_THAT(Bash({"plan", "flat", "--rank", "per"}), ::testing::ElementsAre("per-minute"));
  EXPECT_THAT(Bash({"simulate", "--scene", "fla"}), ::testing::ElementsAre("flat"));
  EXPECT_THAT(Bash({"export", "flat", "--format", "scans"}),
              ::testing::UnorderedElementsAre("scans-e57", "scans-ply"));
  EXPECT_THAT(Bash({"session", "create", "--preset", "leica-rtc"}),
              ::testing::ElementsAre("leica-rtc360"));
  ServerProcess server;
  ASSERT_EQ(Vantage(server, {"session", "create", "museum"}).exit_code, 0);
  // bash takes the address apart.
  const std::vector<std::string> parts = absl::StrSplit(server.address(), ':');
  EXPECT_THAT(Bash({"--server", parts[0], ":", parts[1], "plan", "mu"}),
              ::testing::ElementsAre("museum"));
  // Nobody there, and a word is soon known not to come.
  EXPECT_THAT(Bash({"--server", "127.0.0.1", ":", "1", "plan", "mu"}), ::testing::IsEmpty());
}

TEST_F(Shells, BashCompletesFilesWhereAFileIsWanted) {
  std::ofstream(scratch_.File("scan1.ptx")) << "";
  EXPECT_THAT(Bash({"scan", "push", "flat", scratch_.File("sc")}),
              ::testing::ElementsAre(scratch_.File("scan1.ptx")));
}

TEST_F(Shells, ZshCompletesTheSame) {
  if (!Has("zsh")) GTEST_SKIP() << "zsh is not on this machine";
  EXPECT_EQ(RunProgram({"/usr/bin/env", "zsh", "-n", Script("zsh")}).exit_code, 0);
  // As zsh's own completion would call it, whose part is played here: names on lines.
  const auto offered = [&](const std::string& words) {
    return Lines(RunProgram(
        {"/usr/bin/env", "zsh", "-fc",
         absl::StrCat(
             "_describe() { local n; for n in \"${(@P)2}\"; do print -r -- \"$n\"; done }; "
             "_files() { print -r -- FILES $@ }; compadd() { shift 3; print -rl -- \"${(@P)1}\" }; "
             "source ",
             Script("zsh"), "; words=(vantage ", words, "); CURRENT=$#words; _vantage")}));
  };
  EXPECT_THAT(offered("sca"), Contains(HasSubstr("scan:Scans")));
  EXPECT_THAT(offered("plan flat --rank per"), Contains("per-minute:"));
  EXPECT_THAT(offered("scan push flat ''"), Contains(HasSubstr("FILES")));
}

TEST_F(Shells, FishCompletesTheSame) {
  if (!Has("fish")) GTEST_SKIP() << "fish is not on this machine";
  EXPECT_EQ(RunProgram({"/usr/bin/env", "fish", "--no-execute", Script("fish")}).exit_code, 0);
  const auto offered = [&](const std::string& line) {
    return Lines(
        RunProgram({"/usr/bin/env", "fish", "--no-config", "-c",
                    absl::StrCat("source ", Script("fish"), "; complete -C '", line, "'")}));
  };
  EXPECT_THAT(offered("vantage sca"), Contains(HasSubstr("scan\tScans")));
  EXPECT_THAT(offered("vantage plan flat --rank per"), Contains("per-minute"));
}

}  // namespace
}  // namespace vantage::integration
