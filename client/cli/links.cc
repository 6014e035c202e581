#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct LinksArguments {
  std::string session;
  bool json = false;
};

std::string WorstOf(const v1::LinkedScan& scan) {
  if (!scan.has_worst_link()) return "nothing checks its links";
  return absl::StrFormat("to %s, %.0f %% of what is allowed",
                         client::IdOf(scan.worst_link().scan()),
                         100 * scan.worst_link().test_ratio());
}

std::string ScansTable(const v1::PoseGraph& graph) {
  Table table({"scan", "> links", "> sigma", "worst link"});
  for (const v1::LinkedScan& scan : graph.scans()) {
    const auto links =
        std::count_if(graph.links().begin(), graph.links().end(), [&](const auto& l) {
          return l.first_scan() == scan.scan() || l.second_scan() == scan.scan();
        });
    table.Add({client::IdOf(scan.scan()), absl::StrCat(links),
               scan.held() ? "holds" : Length(scan.position_sigma_m()), WorstOf(scan)});
  }
  return table.ToString();
}

void PrintConnectivity(const v1::PoseGraph& graph) {
  const v1::Connectivity& all = graph.connectivity();
  if (all.tied_pair_count() > 0) {
    std::printf(
        "connected: two scans know of each other to %s in the mean, to %s at worst, along "
        "the best chain of links%s\n",
        Length(all.mean_path_sigma_m()).c_str(), Length(all.longest_path_sigma_m()).c_str(),
        all.piece_count() > 1
            ? absl::StrFormat("; nothing ties the %d pieces", all.piece_count()).c_str()
            : "");
  }
  for (const v1::CutScan& cut : all.cut_scans()) {
    std::printf("cut: without %s %d scan%s would be apart from the rest\n",
                client::IdOf(cut.scan()).c_str(), cut.cut_off_scan_count(),
                cut.cut_off_scan_count() == 1 ? "" : "s");
  }
}

absl::StatusOr<ExitCode> RunLinks(Environment& environment, const LinksArguments& arguments) {
  v1::GetPoseGraphRequest request;
  request.set_name(client::SessionName(arguments.session));
  const auto got = environment.client().Call(request);
  if (!got.ok()) return got.status();
  if (arguments.json) {
    std::fputs(ToJson(*got).c_str(), stdout);
    return ExitCode::kOk;
  }
  const v1::PoseGraph& graph = got->graph();
  if (graph.scans().empty()) {
    std::puts("no scan is in the model yet");
    return ExitCode::kOk;
  }
  std::fputs(ScansTable(graph).c_str(), stdout);
  for (int i = 0; i < graph.links_size(); ++i) {
    const bool doubt = graph.links(i).in_doubt();
    if (graph.link_test_ratios(i) <= 1 && !doubt) continue;
    std::printf(doubt ? "in doubt: %s and %s contradict each other, and count if others agree\n"
                      : "suspect: %s and %s disagree with what the others say of them\n",
                client::IdOf(graph.links(i).first_scan()).c_str(),
                client::IdOf(graph.links(i).second_scan()).c_str());
  }
  PrintConnectivity(graph);
  for (const v1::WeakLink& link : graph.weak_links()) {
    const std::string hangs =
        link.bridge()
            ? absl::StrFormat(", and nothing else ties %d scan%s to the rest",
                              link.hanging_scan_count(), link.hanging_scan_count() == 1 ? "" : "s")
            : "";
    std::printf("weak: %s to %s is known to %s%s\n", client::IdOf(link.first_scan()).c_str(),
                client::IdOf(link.second_scan()).c_str(), Length(link.relative_sigma_m()).c_str(),
                hangs.c_str());
  }
  for (const v1::TieAdvice& advice : graph.advice()) {
    std::printf("helps: %s\n", advice.message().c_str());
  }
  return ExitCode::kOk;
}

}  // namespace

void AddLinks(CLI::App& parent, Environment& environment) {
  AddCommand<LinksArguments>(
      parent, environment, "links", "What ties the scans of a job to each other, and how well",
      "  vantage links flat\n  vantage links flat --json",
      [](CLI::App& command, LinksArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print it as JSON");
      },
      RunLinks);
}

}  // namespace vantage::cli
