#include "client/cli/completion_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vantage::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class CompletionWords : public ::testing::Test {
 protected:
  CompletionWords() {
    program_.add_option("--server", text_, "Address");
    program_.fallthrough();
    CLI::App& scan = *program_.add_subcommand("scan", "Scans");
    CLI::App& push = *scan.add_subcommand("push", "Send scans [now]");
    push.add_option("SESSION", text_, "The job");
    push.add_option("FILE", texts_, "Scan files");
    push.add_flag("--json", flag_, "As JSON");
    push.add_option("--preset", text_, "An instrument");
    CLI::App& show = *scan.add_subcommand("show", "Show a scan");
    show.add_option("SCAN", text_, "SESSION/SCAN");
    CLI::App& plan = *program_.add_subcommand("plan", "Plan");
    plan.add_option("SESSION", text_, "The job");
    plan.add_option("--rank", text_, "How")->check(CLI::IsMember({"score", "per-minute"}));
    plan.add_option("--scanners", texts_, "Whose")->delimiter(',');
    plan.add_option("--with", text_, "What")->check(OneOf({"colour", "intensity"}));
  }

  std::vector<std::string> Words(const std::vector<std::string>& typed) {
    const Completions found = CompleteWords(program_, typed, [this](const NamesWanted& wanted) {
      wanted_ = wanted;
      if (wanted.kind == "sessions")
        return std::vector<Candidate>{{"flat", "A flat"}, {"hall", ""}};
      if (wanted.kind == "scans") return std::vector<Candidate>{{"scan-1", ""}, {"scan-2", ""}};
      if (wanted.kind == "scanners") return std::vector<Candidate>{{"red", ""}, {"blue", ""}};
      return std::vector<Candidate>{};
    });
    paths_ = found.paths;
    std::vector<std::string> words;
    for (const Candidate& candidate : found.candidates) words.push_back(candidate.word);
    return words;
  }

  CLI::App program_{"A program", "vantage"};
  std::string text_;
  std::vector<std::string> texts_;
  bool flag_ = false;
  NamesWanted wanted_;
  Completions::Paths paths_ = Completions::Paths::kNone;
};

TEST_F(CompletionWords, CommandsByTheirPlaceInTheTree) {
  EXPECT_THAT(Words({""}), UnorderedElementsAre("scan", "plan"));
  EXPECT_THAT(Words({"sc"}), ElementsAre("scan"));
  EXPECT_THAT(Words({"scan", ""}), UnorderedElementsAre("push", "show"));
  EXPECT_THAT(Words({"--server", "h:1", "pl"}), ElementsAre("plan"));
  EXPECT_THAT(Words({"nonsense", ""}), IsEmpty());
}

TEST_F(CompletionWords, OptionsOfTheCommandAndOfTheProgram) {
  EXPECT_THAT(Words({"scan", "push", "--"}),
              UnorderedElementsAre("--help", "--json", "--preset", "--server"));
  EXPECT_THAT(Words({"scan", "push", "flat", "--j"}), ElementsAre("--json"));
}

TEST_F(CompletionWords, ValuesOfOptions) {
  EXPECT_THAT(Words({"plan", "--rank", ""}), ElementsAre("score", "per-minute"));
  EXPECT_THAT(Words({"plan", "--rank=p"}), ElementsAre("--rank=per-minute"));
  EXPECT_THAT(Words({"plan", "--with", "c"}), ElementsAre("colour"));
  EXPECT_THAT(Words({"plan", "flat", "--scanners", "red,b"}), ElementsAre("red,blue"));
  EXPECT_EQ(wanted_.session, "flat");
}

TEST_F(CompletionWords, NamesAreAskedOfTheServerThatWasTyped) {
  EXPECT_THAT(Words({"--server", "h:1", "scan", "push", "f"}), ElementsAre("flat"));
  EXPECT_THAT(wanted_.options, ElementsAre("--server", "h:1"));
  EXPECT_THAT(Words({"scan", "show", ""}), ElementsAre("flat/", "hall/"));
  EXPECT_THAT(Words({"scan", "show", "flat/scan-2"}), ElementsAre("flat/scan-2"));
  EXPECT_EQ(wanted_.session, "flat");
}

TEST_F(CompletionWords, FilesAreTheShellsToFind) {
  EXPECT_THAT(Words({"scan", "push", "flat", ""}), IsEmpty());
  EXPECT_EQ(paths_, Completions::Paths::kFiles);
  // As many as one likes.
  Words({"scan", "push", "flat", "a.ptx", ""});
  EXPECT_EQ(paths_, Completions::Paths::kFiles);
  // One job.
  EXPECT_THAT(Words({"plan", "flat", ""}), IsEmpty());
  EXPECT_EQ(paths_, Completions::Paths::kNone);
}

TEST_F(CompletionWords, ListsWhatDoesSomething) {
  std::vector<std::string> names;
  for (const auto& [name, command] : LeafCommands(program_)) names.push_back(name);
  EXPECT_THAT(names, ElementsAre("plan", "scan push", "scan show"));
}

}  // namespace
}  // namespace vantage::cli
