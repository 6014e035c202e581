#include <algorithm>
#include <cstdio>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/cli/completion_script.h"
#include "client/cli/completion_words.h"
#include "client/cli/json.h"
#include "client/library/resource_names.h"
#include "core/sensor/presets.h"

namespace vantage::cli {
namespace {

constexpr double kMostSeconds = 2;  // a person waits for the next word

struct CompletionArguments {
  std::string shell;
};

absl::StatusOr<ExitCode> RunCompletion(Environment&, const CompletionArguments& arguments) {
  std::fputs(arguments.shell == "bash"  ? kBashCompletion
             : arguments.shell == "zsh" ? kZshCompletion
                                        : kFishCompletion,
             stdout);
  return ExitCode::kOk;
}

// The ids of a list, page after page.
template <typename Request, typename Add>
std::vector<Candidate> ListIds(client::Client& client, Request request, const Add& add) {
  std::vector<Candidate> found;
  (void)client.CallForPages(std::move(request), [&](const auto& page) { add(page, found); });
  return found;
}

template <typename Request, typename Items>
std::vector<Candidate> IdsIn(client::Client& client, const std::string& session,
                             const Items& items) {
  Request request;
  request.set_parent(client::SessionName(session));
  return ListIds(client, request, [&](const auto& page, std::vector<Candidate>& found) {
    for (const auto& item : items(page)) {
      std::string words;
      if constexpr (requires { item.display_name(); }) words = item.display_name();
      found.push_back({client::IdOf(item.name()), words});
    }
  });
}

std::vector<Candidate> NamesOnServer(client::Client& client, const NamesWanted& wanted) {
  if (wanted.kind == "sessions") {
    return ListIds(client, v1::ListSessionsRequest(),
                   [](const v1::ListSessionsResponse& page, std::vector<Candidate>& found) {
                     for (const v1::Session& session : page.sessions()) {
                       found.push_back({client::IdOf(session.name()), session.display_name()});
                     }
                   });
  }
  const std::string& in = wanted.session;
  if (wanted.kind == "scans") {
    return IdsIn<v1::ListScansRequest>(client, in, [](const auto& p) { return p.scans(); });
  }
  if (wanted.kind == "plans") {
    return IdsIn<v1::ListPlansRequest>(client, in, [](const auto& p) { return p.plans(); });
  }
  if (wanted.kind == "claims") {
    return IdsIn<v1::ListClaimsRequest>(client, in, [](const auto& p) { return p.claims(); });
  }
  if (wanted.kind == "stations") {
    return IdsIn<v1::ListStationsRequest>(client, in, [](const auto& p) { return p.stations(); });
  }
  if (wanted.kind == "uploads") {
    return IdsIn<v1::ListUploadsRequest>(client, in, [](const auto& p) { return p.uploads(); });
  }
  if (wanted.kind == "rejections") {
    return IdsIn<v1::ListRejectionsRequest>(client, in,
                                            [](const auto& p) { return p.rejections(); });
  }
  if (wanted.kind == "scanners") {
    return IdsIn<v1::ListScannersRequest>(client, in, [](const auto& p) { return p.scanners(); });
  }
  return {};
}

std::vector<Candidate> Settings(const std::string& preset) {
  std::vector<Candidate> found;
  for (const sensor::Preset& known : sensor::Presets()) {
    if (!preset.empty() && known.name != preset) continue;
    for (const sensor::ScanSetting& setting : known.settings) {
      found.push_back({setting.name, known.title});
    }
  }
  return found;
}

}  // namespace

void PrintCompletions(CLI::App& program, Environment& environment,
                      const std::vector<std::string>& words) {
  const auto find = [&](const NamesWanted& wanted) -> std::vector<Candidate> {
    if (wanted.kind == "presets") {
      std::vector<Candidate> found;
      for (const sensor::Preset& preset : sensor::Presets()) {
        found.push_back({preset.name, preset.title});
      }
      return found;
    }
    if (wanted.kind == "settings") return Settings(wanted.session);
    // The environment, and the options that were typed, say which server is asked. Some command has
    // to be there; it is not run.
    std::vector<std::string> line = wanted.options;
    line.emplace_back("health");
    std::reverse(line.begin(), line.end());
    try {
      program.parse(line);
    } catch (const CLI::Error&) {
      return {};
    }
    if (wanted.kind == "servers") {
      std::vector<Candidate> found;
      const absl::StatusOr<ServerBook> book = environment.ReadBook();
      if (!book.ok()) return found;
      for (const auto& [name, server] : book->servers) found.push_back({name, server.address});
      return found;
    }
    if (!environment.ChooseServer(program).ok()) return {};
    environment.connection.attempts = 1;
    environment.connection.timeout = kMostSeconds;
    environment.connection.loading_patience = 0;
    return NamesOnServer(environment.client(), wanted);
  };
  const Completions found = CompleteWords(program, words, find);
  std::puts(found.paths == Completions::Paths::kFiles     ? ":files"
            : found.paths == Completions::Paths::kFolders ? ":folders"
                                                          : ":none");
  for (const Candidate& candidate : found.candidates) {
    // What people named may have lines and tabs, which mean something here and to a shell.
    if (std::any_of(candidate.word.begin(), candidate.word.end(), absl::ascii_iscntrl)) continue;
    std::string description = candidate.description;
    std::replace_if(description.begin(), description.end(), absl::ascii_iscntrl, ' ');
    std::printf("%s\t%s\n", candidate.word.c_str(), description.c_str());
  }
}

void PrintCommands(const CLI::App& program) {
  for (const auto& [name, command] : LeafCommands(program)) {
    std::string options;
    for (const CLI::Option* option : command->get_options({})) {
      for (const std::string& long_name : option->get_lnames()) {
        absl::StrAppend(&options, options.empty() ? "" : " ", "--", long_name);
      }
    }
    std::printf("%s\t%s\t%s\n", name.c_str(), command->get_description().c_str(), options.c_str());
  }
}

void AddCompletion(CLI::App& parent, Environment& environment) {
  AddCommand<CompletionArguments>(
      parent, environment, "completion",
      "Print what makes a shell complete commands, options, and names on the server",
      "  source <(vantage completion bash)          (for this shell; zsh likewise)\n"
      "  vantage completion fish > ~/.config/fish/completions/vantage.fish\n"
      "The Debian package has installed it already.",
      [](CLI::App& command, CompletionArguments& a) {
        command.add_option("SHELL", a.shell, "bash, zsh or fish")
            ->required()
            ->check(OneOf({"bash", "zsh", "fish"}));
      },
      RunCompletion);
}

}  // namespace vantage::cli
