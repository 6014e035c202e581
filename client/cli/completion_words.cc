#include "client/cli/completion_words.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace vantage::cli {
namespace {

constexpr char kOneOf[] = "one of ";

// How the values of an option or a position are found, by its name.
const std::map<std::string, std::string>& Kinds() {
  static const auto* const kKinds =
      new std::map<std::string, std::string>{{"SESSION", "sessions"},
                                             {"SCAN", "sessions/scans"},
                                             {"PLAN", "sessions/plans"},
                                             {"CLAIM", "sessions/claims"},
                                             {"STATION", "sessions/stations"},
                                             {"UPLOAD", "sessions/uploads"},
                                             {"REJECTION", "sessions/rejections"},
                                             {"SCANNER", "scanners"},
                                             {"JOB", "sessions"},
                                             {"FILE", "files"},
                                             {"FOLDER", "folders"},
                                             {"--server", "servers"},
                                             {"--client-config", "files"},
                                             {"--tls-ca", "files"},
                                             {"--tls-cert", "files"},
                                             {"--tls-key", "files"},
                                             {"--token-file", "files"},
                                             {"--output", "files"},
                                             {"--config", "files"},
                                             {"--scanner-from", "files"},
                                             {"--prior-file", "files"},
                                             {"--targets", "files"},
                                             {"--from", "files"},
                                             {"--picture", "files"},
                                             {"--mesh", "files"},
                                             {"--compare", "files"},
                                             {"--vantaged", "files"},
                                             {"--pictures", "folders"},
                                             {"--data", "folders"},
                                             {"--by", "scanners"},
                                             {"--scanners", "scanners"},
                                             {"--scan", "sessions/scans"},
                                             {"--preset", "presets"},
                                             {"--setting", "settings"}};
  return *kKinds;
}

std::string NameOf(const CLI::Option& option) {
  if (option.get_positional()) return option.get_name(true);
  return option.get_lnames().empty() ? "-" + option.get_snames().front()
                                     : "--" + option.get_lnames().front();
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

// Values that its validators name.
std::vector<std::string> ValuesOf(const CLI::Option& option) {
  // CLI11 hands out its validators only to be changed.
  auto& asked = const_cast<CLI::Option&>(option);
  for (int i = 0;; ++i) {
    try {
      const CLI::Validator* validator = asked.get_validator(i);
      absl::string_view name = validator->get_name();
      if (absl::ConsumePrefix(&name, kOneOf)) return absl::StrSplit(name, '|');
      const std::string text = validator->get_description();
      absl::string_view described = text;
      if (absl::ConsumePrefix(&described, "{") && absl::ConsumeSuffix(&described, "}")) {
        return absl::StrSplit(described, ',');
      }
    } catch (const CLI::OptionNotFound&) {
      return {};
    }
  }
}

// The first line, without what stands in brackets.
std::string Brief(const std::string& description) {
  std::string text = description.substr(0, description.find('\n'));
  if (const size_t bracket = text.rfind(" ["); bracket != std::string::npos) text.resize(bracket);
  return text;
}

// A command line as far as it is typed.
class Typed {
 public:
  Typed(const CLI::App& program, const std::vector<std::string>& words) : app_(&program) {
    for (size_t i = 0; i + 1 < words.size(); ++i) Read(words[i]);
    partial_ = words.empty() ? "" : words.back();
  }

  Completions Complete(const FindNames& find) const {
    Completions found;
    if (option_ != nullptr) {
      AddValues(*option_, find, partial_, "", found);
      return found;
    }
    const size_t equals = partial_.find('=');
    if (absl::StartsWith(partial_, "--") && equals != std::string::npos) {
      if (const CLI::Option* option = Find(partial_.substr(0, equals)); option != nullptr) {
        AddValues(*option, find, partial_.substr(equals + 1), partial_.substr(0, equals + 1),
                  found);
      }
      return found;
    }
    if (absl::StartsWith(partial_, "-")) {
      AddOptions(found);
      return found;
    }
    for (const CLI::App* sub : app_->get_subcommands({})) {
      if (positions_.empty()) Add(sub->get_name(), Brief(sub->get_description()), found);
    }
    const std::vector<const CLI::Option*> positions = Positions();
    if (!positions.empty()) {
      const CLI::Option& position = *positions[std::min(positions_.size(), positions.size() - 1)];
      if (positions_.size() < positions.size() || position.get_items_expected_max() > 1) {
        AddValues(position, find, partial_, "", found);
      }
    }
    return found;
  }

 private:
  void Read(const std::string& word) {
    if (option_ != nullptr) {
      Take(*option_, word);
      option_ = nullptr;
      return;
    }
    if (absl::StartsWith(word, "-") && word.size() > 1) {
      const size_t equals = word.find('=');
      const CLI::Option* option = Find(word.substr(0, equals));
      if (option == nullptr || !TakesValue(*option)) return;
      if (equals == std::string::npos) {
        option_ = option;
      } else {
        Take(*option, word.substr(equals + 1));
      }
      return;
    }
    for (const CLI::App* sub : app_->get_subcommands({})) {
      if (sub->get_name() != word || !positions_.empty()) continue;
      app_ = sub;
      return;
    }
    positions_.push_back(word);
  }

  void Take(const CLI::Option& option, const std::string& value) {
    const std::string name = NameOf(option);
    values_[name] = value;
    // Those of the whole program say which server to ask.
    const CLI::App* program = app_;
    while (program->get_parent() != nullptr) program = program->get_parent();
    if (program->get_option_no_throw(name) == &option) {
      program_options_.push_back(name);
      program_options_.push_back(value);
    }
  }

  // Of the command, or of what it is a command of.
  const CLI::Option* Find(const std::string& name) const {
    for (const CLI::App* app = app_; app != nullptr; app = app->get_parent()) {
      if (const CLI::Option* option = app->get_option_no_throw(name); option != nullptr) {
        return option;
      }
    }
    return nullptr;
  }

  std::vector<const CLI::Option*> Positions() const {
    return app_->get_options([](const CLI::Option* o) { return o->get_positional(); });
  }

  void AddOptions(Completions& found) const {
    for (const CLI::App* app = app_; app != nullptr; app = app->get_parent()) {
      for (const CLI::Option* option : app->get_options({})) {
        // Every command has a help of its own.
        if (app != app_ && option == app->get_help_ptr()) continue;
        for (const std::string& name : option->get_lnames()) {
          Add("--" + name, Brief(option->get_description()), found);
        }
      }
    }
  }

  void AddValues(const CLI::Option& option, const FindNames& find, const std::string& partial,
                 const std::string& before, Completions& found) const {
    // A list goes on behind its last comma.
    const size_t comma = option.get_delimiter() == ',' ? partial.rfind(',') : std::string::npos;
    const std::string begun =
        before + (comma == std::string::npos ? "" : partial.substr(0, comma + 1));
    const std::string rest = comma == std::string::npos ? partial : partial.substr(comma + 1);
    const auto add = [&](const std::string& word, const std::string& description) {
      if (absl::StartsWith(word, rest)) found.candidates.push_back({begun + word, description});
    };
    for (const std::string& value : ValuesOf(option)) add(value, "");
    const auto kind = Kinds().find(NameOf(option));
    if (kind == Kinds().end()) return;
    if (kind->second == "files") found.paths = Completions::Paths::kFiles;
    if (kind->second == "folders") found.paths = Completions::Paths::kFolders;
    if (found.paths != Completions::Paths::kNone) return;
    NamesWanted wanted;
    wanted.options = program_options_;
    absl::string_view of = kind->second;
    if (absl::ConsumePrefix(&of, "sessions/")) {
      // First the session, then what is in it: SESSION/SCAN.
      const size_t slash = rest.find('/');
      wanted.kind = slash == std::string::npos ? "sessions" : std::string(of);
      wanted.session = slash == std::string::npos ? "" : rest.substr(0, slash);
      for (const Candidate& name : find(wanted)) {
        add(slash == std::string::npos ? name.word + "/"
                                       : absl::StrCat(wanted.session, "/", name.word),
            name.description);
      }
      return;
    }
    wanted.kind = kind->second;
    if (!positions_.empty()) wanted.session = positions_.front();
    if (wanted.kind == "settings") {
      const auto preset = values_.find("--preset");
      wanted.session = preset == values_.end() ? "" : preset->second;
    }
    for (const Candidate& name : find(wanted)) add(name.word, name.description);
  }

  void Add(const std::string& word, const std::string& description, Completions& found) const {
    if (absl::StartsWith(word, partial_)) found.candidates.push_back({word, description});
  }

  const CLI::App* app_;                  // the command that was typed
  const CLI::Option* option_ = nullptr;  // whose value comes next
  std::vector<std::string> positions_;
  std::map<std::string, std::string> values_;  // of options
  std::vector<std::string> program_options_;
  std::string partial_;
};

void AddLeaves(const CLI::App& app, const std::string& name,
               std::vector<std::pair<std::string, const CLI::App*>>& leaves) {
  const auto subs = app.get_subcommands({});
  if (subs.empty()) leaves.emplace_back(name, &app);
  for (const CLI::App* sub : subs) {
    AddLeaves(*sub, name.empty() ? sub->get_name() : absl::StrCat(name, " ", sub->get_name()),
              leaves);
  }
}

}  // namespace

CLI::Validator OneOf(const std::vector<std::string>& values) {
  CLI::Validator validator = CLI::IsMember(values).description("");
  validator.name(absl::StrCat(kOneOf, absl::StrJoin(values, "|")));
  return validator;
}

Completions CompleteWords(const CLI::App& program, const std::vector<std::string>& words,
                          const FindNames& find) {
  return Typed(program, words).Complete(find);
}

std::vector<std::pair<std::string, const CLI::App*>> LeafCommands(const CLI::App& program) {
  std::vector<std::pair<std::string, const CLI::App*>> leaves;
  AddLeaves(program, "", leaves);
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

}  // namespace vantage::cli
