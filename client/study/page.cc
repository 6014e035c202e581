#include "client/study/page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/study/median.h"
#include "client/study/planner_list.h"
#include "client/study/svg.h"
#include "client/study/table.h"

namespace vantage::study {
namespace {

using Eigen::Vector2d;
using study_records::v1::JobRecord;
using study_records::v1::ScanRecord;

constexpr const char* kColours[] = {"#1f5fbf", "#d9480f", "#2b8a3e", "#862e9c", "#c2255c",
                                    "#0b7285", "#846358", "#5c940d", "#495057", "#e67700",
                                    "#364fc7", "#a61e4d", "#087f5b", "#9c36b5"};
constexpr double kPlanWidth = 430;  // px

constexpr char kHead[] =
    R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Planning study</title><style>
body{font:15px/1.45 sans-serif;color:#222;max-width:1320px;margin:24px auto;padding:0 16px}
svg text{font-family:sans-serif}table{border-collapse:collapse;margin:12px 0}
td,th{border:1px solid #ddd;padding:3px 9px;text-align:right}
td:first-child,th:first-child{text-align:left}
th{background:#f4f4f4}td.win{font-weight:bold;background:#e6f4ea}td.known{color:#777}
.row{display:flex;flex-wrap:wrap;gap:12px}.small{color:#666;font-size:13px}
</style></head><body>
)";

std::string ColourOf(const std::string& planner) {
  const std::vector<StudyPlanner>& all = AllPlanners();
  const auto at = std::find_if(all.begin(), all.end(),
                               [&](const StudyPlanner& p) { return p.name == planner; });
  return kColours[static_cast<size_t>(at - all.begin()) % std::size(kColours)];
}

bool KnowsTheScene(const std::string& planner) {
  const StudyPlanner* known = FindPlanner(planner);
  return known != nullptr && known->kind == PlannerKind::kKnowsTheScene;
}

std::string Cell(const std::string& text, const char* style = "") {
  return absl::StrCat("<td", *style != 0 ? absl::StrCat(" class='", style, "'") : "", ">",
                      Escape(text), "</td>");
}

std::string FigureTable(const study_records::v1::Table& table) {
  std::string html =
      "<table><tr><th>figure</th><th>value</th><th>target</th><th>by scene</th></tr>";
  for (const study_records::v1::Figure& figure : table.figures()) {
    absl::StrAppend(&html, "<tr>", Cell(figure.name()), Cell(figure.stated()),
                    Cell(figure.target()), Cell(figure.detail()), "</tr>");
  }
  return html + "</table>\n";
}

std::string ScansOf(const study_records::v1::Row& row) {
  return row.has_scans95() ? absl::StrFormat("%g", row.scans95())
                           : absl::StrFormat("> %d", row.most_scans());
}

// The table of scans until the goal: one row a planner, one column a scene.
std::string WinnersTable(const study_records::v1::Table& table) {
  std::vector<std::string> scenes;
  std::vector<std::string> planners;
  std::map<std::pair<std::string, std::string>, const study_records::v1::Row*> rows;
  for (const study_records::v1::Row& row : table.rows()) {
    if (std::find(scenes.begin(), scenes.end(), row.scene()) == scenes.end()) {
      scenes.push_back(row.scene());
    }
    if (std::find(planners.begin(), planners.end(), row.planner()) == planners.end()) {
      planners.push_back(row.planner());
    }
    rows[{row.scene(), row.planner()}] = &row;
  }
  std::string html = "<table><tr><th>planner</th>";
  for (const std::string& scene : scenes) absl::StrAppend(&html, "<th>", Escape(scene), "</th>");
  html += "<th>what it does</th></tr>";
  for (const std::string& planner : planners) {
    absl::StrAppend(&html, "<tr>", Cell(planner));
    for (const std::string& scene : scenes) {
      const auto at = rows.find({scene, planner});
      if (at == rows.end()) {
        html += Cell("");
        continue;
      }
      const study_records::v1::Row& row = *at->second;
      html += Cell(ScansOf(row), row.winner() ? "win" : KnowsTheScene(planner) ? "known" : "");
    }
    const StudyPlanner* known = FindPlanner(planner);
    absl::StrAppend(&html, "<td style='text-align:left'>",
                    Escape(known == nullptr ? "" : known->words), "</td></tr>");
  }
  return html + "</table>\n";
}

std::string OverBudget(const study_records::v1::Row& row) {
  if (row.budgeted() == 0) return "";
  return absl::StrFormat("%d of %d", row.over_budget(), row.budgeted());
}

std::string SceneTable(const study_records::v1::Table& table, const std::string& scene) {
  std::string html =
      "<table><tr><th>planner</th><th>jobs</th><th>reached 95 %</th><th>scans to 95 %</th><th>"
      "minutes to 95 %</th><th>area under curve</th><th>lost scans</th><th>obtained / "
      "predicted</th><th>share of the best true gain</th><th>s a plan</th><th>plans "
      "over budget</th></tr>";
  for (const study_records::v1::Row& row : table.rows()) {
    if (row.scene() != scene) continue;
    absl::StrAppend(&html, "<tr>", Cell(row.planner()), Cell(absl::StrCat(row.jobs())),
                    Cell(absl::StrCat(row.reached())), Cell(ScansOf(row)),
                    Cell(row.has_minutes95() ? absl::StrFormat("%.1f", row.minutes95()) : ""),
                    Cell(absl::StrFormat("%.3f", row.area_under_curve())),
                    Cell(absl::StrFormat("%d of %d", row.lost(), row.scans())),
                    Cell(row.has_obtained_over_predicted()
                             ? absl::StrFormat("%.2f", row.obtained_over_predicted())
                             : ""),
                    Cell(absl::StrFormat("%.2f", row.share_of_best())),
                    Cell(absl::StrFormat("%.2f", row.plan_seconds())), Cell(OverBudget(row)),
                    "</tr>");
  }
  return html + "</table>\n";
}

using Jobs = std::vector<const JobRecord*>;

// The median of at(job) over the jobs.
template <typename At>
double MedianOf(const Jobs& jobs, At at) {
  std::vector<double> values;
  for (const JobRecord* job : jobs) values.push_back(at(*job));
  return Median(std::move(values));
}

double CoveredAfter(const JobRecord& job, int scans) {
  if (job.scans().empty()) return 0;
  return job.scans(std::min(scans, job.scans_size()) - 1).covered();
}

double CoveredAt(const JobRecord& job, double minutes) {
  double covered = 0;
  for (const ScanRecord& scan : job.scans()) {
    if (scan.minutes() <= minutes) covered = scan.covered();
  }
  return covered;
}

std::string Curves(const std::vector<std::pair<std::string, Jobs>>& planners, int most_scans,
                   double goal) {
  double most_minutes = 0;
  for (const auto& [name, jobs] : planners) {
    for (const JobRecord* job : jobs) {
      if (job->scans_size() > 0) {
        most_minutes = std::max(most_minutes, job->scans().rbegin()->minutes());
      }
    }
  }
  std::vector<Curve> by_scan;
  std::vector<Curve> by_minute;
  for (const auto& [name, jobs] : planners) {
    Curve scans{name, ColourOf(name), KnowsTheScene(name), {}};
    Curve minutes = scans;
    for (int n = 1; n <= most_scans; ++n) {
      scans.points.emplace_back(
          n, MedianOf(jobs, [n](const JobRecord& job) { return CoveredAfter(job, n); }));
    }
    for (double t = 0; t <= most_minutes + 0.5; t += 0.5) {
      minutes.points.emplace_back(
          t, MedianOf(jobs, [t](const JobRecord& job) { return CoveredAt(job, t); }));
    }
    by_scan.push_back(std::move(scans));
    by_minute.push_back(std::move(minutes));
  }
  return absl::StrCat("<div class='row'>",
                      Chart("Attainable surface at density, by scan (median of the seeds)", "scans",
                            1, most_scans, goal, by_scan),
                      Chart("The same by minute: walking, setting up, scanning", "minutes", 0,
                            most_minutes, goal, by_minute),
                      "</div>\n");
}

std::string JobPlan(const FloorPlanDrawing& scene, const JobRecord& job) {
  Vector2d low = Vector2d::Constant(1e9);
  Vector2d high = Vector2d::Constant(-1e9);
  for (const auto& [a, b] : scene.walls) {
    low = low.cwiseMin(a).cwiseMin(b);
    high = high.cwiseMax(a).cwiseMax(b);
  }
  if ((high.array() <= low.array()).any()) return "";
  const double scale = (kPlanWidth - 20) / (high - low).x();
  const double height = scale * (high - low).y() + 44;
  const auto place = [&](const Vector2d& p) {
    return Vector2d(10 + scale * (p.x() - low.x()), height - 10 - scale * (p.y() - low.y()));
  };
  const auto placed = [&](const PlanSegments& segments) {
    PlanSegments out;
    for (const auto& [a, b] : segments) out.emplace_back(place(a), place(b));
    return out;
  };
  Svg svg(kPlanWidth, height);
  const std::string title = absl::StrFormat(
      "%s, seed %d: %d scans, %.1f %%", job.planner(), static_cast<int>(job.seed()),
      job.scans_size(), job.scans().empty() ? 0.0 : 100 * job.scans().rbegin()->covered());
  svg.Text({10, 18}, title, 13, "#222", "start");
  svg.Segments(placed(scene.furniture), "#c8c8c8", 1);
  svg.Segments(placed(scene.walls), "#444", 1.4);
  std::vector<Vector2d> way;
  for (const ScanRecord& scan : job.scans()) {
    way.push_back(place({scan.position().x(), scan.position().y()}));
  }
  svg.Polyline(way, ColourOf(job.planner()), 0.8, "3 3");
  for (const ScanRecord& scan : job.scans()) {
    const Vector2d at = way[static_cast<size_t>(scan.number() - 1)];
    svg.Circle(at, 8, scan.merged() ? ColourOf(job.planner()) : "#fff",
               scan.merged() ? "#fff" : "#c00");
    svg.Text(at + Vector2d(0, 4), absl::StrCat(scan.number()), 10, scan.merged() ? "#fff" : "#c00",
             "middle");
  }
  return svg.Finish(title);
}

}  // namespace

PlanSegments CutMesh(const simulation::TriangleMesh& mesh, double height) {
  PlanSegments segments;
  for (const auto& triangle : mesh.triangles) {
    std::vector<Vector2d> crossings;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = mesh.vertices[triangle[static_cast<size_t>(k)]].cast<double>();
      const Eigen::Vector3d b =
          mesh.vertices[triangle[static_cast<size_t>((k + 1) % 3)]].cast<double>();
      if ((a.z() > height) == (b.z() > height)) continue;
      const double share = (height - a.z()) / (b.z() - a.z());
      crossings.emplace_back((a + share * (b - a)).head<2>());
    }
    if (crossings.size() == 2) segments.emplace_back(crossings[0], crossings[1]);
  }
  return segments;
}

FloorPlanDrawing DrawFloorPlan(const simulated_job::Site& site, int most_scans) {
  return {site.name, CutMesh(site.mesh, site.floor_height + 1.3),
          CutMesh(site.mesh, site.floor_height + 0.4), most_scans};
}

std::string StudyPage(const study_records::v1::Table& table, const std::vector<JobRecord>& records,
                      const std::vector<FloorPlanDrawing>& scenes, double goal) {
  std::string html = kHead;
  absl::StrAppend(
      &html, "<h1>Planning study</h1>\n<p class='small'>", Escape(table.settings()),
      "</p>\n<h2>Figures</h2>\n", FigureTable(table),
      "<h2>Scans until 95 %</h2>\n<p>Median over the seeds of the scans until ",
      absl::StrFormat("%.0f %%", goal * 100),
      " of what any allowed position could measure at the required density is measured "
      "so; lost scans count. Obtained is surface by its true share of the density, predicted is "
      "the planner's "
      "valued score over D: not the same quantity. Green: the fewest of those that do not know the "
      "scene.</p>\n",
      WinnersTable(table));
  for (const FloorPlanDrawing& scene : scenes) {
    std::vector<std::pair<std::string, Jobs>> planners;
    for (const JobRecord& record : records) {
      if (record.scene() != scene.scene) continue;
      if (planners.empty() || planners.back().first != record.planner()) {
        planners.push_back({record.planner(), {}});
      }
      planners.back().second.push_back(&record);
    }
    if (planners.empty()) continue;
    absl::StrAppend(&html, "<h2>", Escape(scene.scene), "</h2>\n",
                    absl::StrFormat("<p>%.1f m\u00b2 attainable.</p>\n",
                                    planners.front().second.front()->attainable_area()),
                    Curves(planners, scene.most_scans, goal), SceneTable(table, scene.scene),
                    "<div class='row'>");
    for (const auto& [name, jobs] : planners) absl::StrAppend(&html, JobPlan(scene, *jobs.front()));
    html += "</div>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace vantage::study
