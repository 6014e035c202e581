#include "client/study/cover_program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client/library/error.h"
#include "client/study/own_server.h"

namespace vantage::study {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr size_t kMostSamples = 1000;
constexpr int kLatticeStride = 2;      // of the allowed positions
constexpr double kLeastOverlap = 0.1;  // of the larger scan
constexpr size_t kTermsPerLine = 12;   // LP readers have short lines

// A folder that is removed with this object.
class Scratch {
 public:
  Scratch() : path_((fs::temp_directory_path() / "vantage-cover-XXXXXX").string()) {
    made_ = ::mkdtemp(path_.data()) != nullptr;
  }
  ~Scratch() {
    std::error_code error;
    if (made_) fs::remove_all(path_, error);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  bool made() const { return made_; }
  std::string File(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
  bool made_ = false;
};

bool Contains(const simulation::SampleSet& set, size_t element) {
  return (set[element / 64] >> (element % 64) & 1) != 0;
}

// Elements that are covered by the same candidates, counted together.
struct ElementClass {
  std::vector<size_t> candidates;
  size_t count = 0;
};

std::vector<ElementClass> Classes(const CoverProblem& problem) {
  std::map<std::vector<size_t>, size_t> counts;
  const simulation::SampleSet& done = problem.sets[problem.start];
  for (size_t element = 0; element < done.size() * 64; ++element) {
    if (Contains(done, element)) continue;
    std::vector<size_t> candidates;
    for (size_t i = 0; i < problem.sets.size(); ++i) {
      if (Contains(problem.sets[i], element)) candidates.push_back(i);
    }
    if (!candidates.empty()) ++counts[candidates];
  }
  std::vector<ElementClass> classes;
  classes.reserve(counts.size());
  for (auto& [candidates, count] : counts) classes.push_back({candidates, count});
  return classes;
}

// A line of an LP file, wrapped.
class Terms {
 public:
  void Add(absl::string_view term) {
    if (count_++ % kTermsPerLine == 0) absl::StrAppend(&text_, "\n ");
    absl::StrAppend(&text_, term, " ");
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  size_t count_ = 0;
};

// 'If `chosen` is taken then one of these is taken': the constraint that keeps a solution
// connected.
struct Cut {
  size_t chosen = 0;
  std::vector<size_t> one_of;
};

// CPLEX's LP format, which every solver reads.
std::string WriteProgram(const CoverProblem& problem, const std::vector<ElementClass>& classes,
                         size_t missing, const std::vector<Cut>& cuts) {
  std::string lp = "Minimize\n obj:";
  Terms objective;
  Terms binaries;
  for (size_t i = 0; i < problem.sets.size(); ++i) {
    objective.Add(absl::StrCat("+ x", i));
    binaries.Add(absl::StrCat("x", i));
  }
  absl::StrAppend(&lp, objective.text(), "\nSubject To\n start: x", problem.start, " = 1\n");
  Terms goal;
  std::string bounds;
  for (size_t c = 0; c < classes.size(); ++c) {
    Terms covered;
    covered.Add(absl::StrCat("z", c));
    for (const size_t i : classes[c].candidates) covered.Add(absl::StrCat("- x", i));
    absl::StrAppend(&lp, " c", c, ":", covered.text(), "<= 0\n");
    goal.Add(absl::StrCat("+ ", classes[c].count, " z", c));
    absl::StrAppend(&bounds, " 0 <= z", c, " <= 1\n");
  }
  absl::StrAppend(&lp, " goal:", goal.text(), ">= ", missing, "\n");
  for (size_t k = 0; k < cuts.size(); ++k) {
    Terms cut;
    cut.Add(absl::StrCat("x", cuts[k].chosen));
    for (const size_t i : cuts[k].one_of) cut.Add(absl::StrCat("- x", i));
    absl::StrAppend(&lp, " k", k, ":", cut.text(), "<= 0\n");
  }
  absl::StrAppend(&lp, "Bounds\n", bounds, "Binary", binaries.text(), "\nEnd\n");
  return lp;
}

absl::Status RunQuietly(const std::vector<std::string>& arguments) {
  std::vector<char*> raw;
  raw.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));
  raw.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  pid_t pid = -1;
  const int failed = ::posix_spawn(&pid, raw[0], &actions, nullptr, raw.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return absl::InternalError(absl::StrCat("cannot run ", arguments[0]));
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status)) return absl::InternalError(absl::StrCat(arguments[0], " was killed"));
  return absl::OkStatus();
}

// The solver's answer: whether it is proved, and the variables that are 1.
struct Answer {
  bool optimal = false;
  std::set<size_t> chosen;
};

Answer ReadAnswer(const std::string& path) {
  Answer answer;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (absl::StartsWith(line, "Optimal") || absl::StrContains(line, "INTEGER OPTIMAL")) {
      answer.optimal = true;
    }
    const std::vector<std::string> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t"), absl::SkipEmpty());
    for (size_t i = 0; i + 1 < words.size(); ++i) {
      size_t index = 0;
      if (words[i].front() != 'x' || !absl::SimpleAtoi(words[i].substr(1), &index)) continue;
      double value = 0;  // GLPK marks whole numbers with a star in between
      const std::string& number =
          words[i + 1] == "*" && i + 2 < words.size() ? words[i + 2] : words[i + 1];
      if (absl::SimpleAtod(number, &value) && value > 0.5) answer.chosen.insert(index);
      break;
    }
  }
  return answer;
}

absl::StatusOr<std::set<size_t>> Solve(const std::string& program, double seconds) {
  const std::string solver = FindCoverSolver();
  if (solver.empty()) {
    return client::WithFix(
        absl::FailedPreconditionError("no integer programming solver is on PATH"),
        "install coinor-cbc or glpk-utils");
  }
  const Scratch scratch;
  if (!scratch.made()) return absl::PermissionDeniedError("cannot make a folder for the solver");
  const std::string model = scratch.File("model.lp");
  const std::string out = scratch.File("out.txt");
  std::ofstream(model) << program;
  const std::string limit = absl::StrCat(std::max(1, static_cast<int>(seconds)));
  const absl::Status run = fs::path(solver).filename() == "cbc"
                               ? RunQuietly({solver, model, "sec", limit, "solve", "solution", out})
                               : RunQuietly({solver, "--lp", model, "--tmlim", limit, "-o", out});
  if (!run.ok()) return run;
  const Answer answer = ReadAnswer(out);
  if (!answer.optimal) {
    return absl::DeadlineExceededError(
        absl::StrFormat("%s proved no optimum within %s s", solver, limit));
  }
  return answer.chosen;
}

// The members of `chosen` that are connected with `from`, in the order in which they are found.
std::vector<size_t> Component(const CoverProblem& problem, const std::set<size_t>& chosen,
                              size_t from) {
  std::vector<size_t> met = {from};
  for (size_t head = 0; head < met.size(); ++head) {
    for (const size_t i : problem.neighbours[met[head]]) {
      if (chosen.count(i) > 0 && std::find(met.begin(), met.end(), i) == met.end()) {
        met.push_back(i);
      }
    }
  }
  return met;
}

// A solution that takes a member of a component without the start must take a neighbour of the
// component, too.
std::vector<Cut> CutsFor(const CoverProblem& problem, const std::vector<size_t>& component) {
  std::set<size_t> around;
  for (const size_t i : component) {
    around.insert(problem.neighbours[i].begin(), problem.neighbours[i].end());
  }
  for (const size_t i : component) around.erase(i);
  std::vector<Cut> cuts;
  cuts.reserve(component.size());
  for (const size_t i : component) cuts.push_back({i, {around.begin(), around.end()}});
  return cuts;
}

}  // namespace

std::string FindCoverSolver() {
  const std::string cbc = FindOnPath("cbc");
  return cbc.empty() ? FindOnPath("glpsol") : cbc;
}

absl::StatusOr<std::vector<size_t>> SolveCover(const CoverProblem& problem, double seconds) {
  const auto begun = Clock::now();
  const size_t done = CountOf(problem.sets[problem.start]);
  if (done >= problem.goal) return std::vector<size_t>();
  const std::vector<ElementClass> classes = Classes(problem);
  size_t possible = done;
  for (const ElementClass& c : classes) possible += c.count;
  if (possible < problem.goal) {
    return absl::FailedPreconditionError("all candidates together do not reach the goal");
  }
  std::vector<Cut> cuts;
  while (true) {
    const double left = seconds - std::chrono::duration<double>(Clock::now() - begun).count();
    if (left <= 0) return absl::DeadlineExceededError("the positions do not come to hang together");
    auto chosen = Solve(WriteProgram(problem, classes, problem.goal - done, cuts), left);
    if (!chosen.ok()) return chosen.status();
    chosen->insert(problem.start);
    std::vector<size_t> route = Component(problem, *chosen, problem.start);
    if (route.size() == chosen->size()) {
      route.erase(route.begin());
      return route;
    }
    std::set<size_t> apart = *chosen;
    for (const size_t i : route) apart.erase(i);
    while (!apart.empty()) {
      const std::vector<size_t> component = Component(problem, apart, *apart.begin());
      for (Cut& cut : CutsFor(problem, component)) cuts.push_back(std::move(cut));
      for (const size_t i : component) apart.erase(i);
    }
  }
}

absl::StatusOr<std::vector<Eigen::Vector3d>> BestCover(const StudyScene& scene, uint64_t seed,
                                                       double seconds) {
  const Eigen::Vector3d origin = scene.site().mesh.Bounds().min();
  const size_t start = scene.StartIndex(seed);
  std::vector<size_t> elements;
  for (size_t e = 0; e < scene.attainable().size() * 64; ++e) {
    if (Contains(scene.attainable(), e)) elements.push_back(e);
  }
  const size_t thinning = (elements.size() + kMostSamples - 1) / kMostSamples;
  const size_t count = (elements.size() + thinning - 1) / thinning;

  CoverProblem problem;
  std::vector<Eigen::Vector3d> places;
  for (size_t i = 0; i < scene.positions().size(); ++i) {
    const Eigen::Vector2d lattice = (scene.positions()[i] - origin).head<2>() /
                                    (simulated_job::kLatticeOfTruth * kLatticeStride);
    const bool on = (lattice - lattice.array().round().matrix()).cwiseAbs().maxCoeff() < 0.1;
    if (!on && i != start) continue;
    if (i == start) problem.start = places.size();
    places.push_back(scene.positions()[i]);
    simulation::SampleSet set((count + 63) / 64, 0);
    for (size_t k = 0; k < count; ++k) {
      if (Contains(scene.sets()[i], elements[k * thinning])) set[k / 64] |= uint64_t{1} << (k % 64);
    }
    problem.sets.push_back(std::move(set));
  }
  problem.goal = static_cast<size_t>(std::ceil(scene.settings().goal * static_cast<double>(count)));
  problem.neighbours.resize(places.size());
  for (size_t i = 0; i < places.size(); ++i) {
    for (size_t j = 0; j < places.size(); ++j) {
      const size_t size_i = CountOf(problem.sets[i]);
      const size_t size_j = CountOf(problem.sets[j]);
      const size_t shared = size_i - CountWithout(problem.sets[i], problem.sets[j]);
      const auto larger = static_cast<double>(std::max(size_i, size_j));
      if (i != j && static_cast<double>(shared) >= kLeastOverlap * larger) {
        problem.neighbours[i].push_back(j);
      }
    }
  }
  const auto route = SolveCover(problem, seconds);
  if (!route.ok()) return route.status();
  std::vector<Eigen::Vector3d> positions;
  for (const size_t i : *route) positions.push_back(places[i]);
  return positions;
}

}  // namespace vantage::study
