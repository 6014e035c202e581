#include "client/study/cover_program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client/library/error.h"
#include "client/study/own_server.h"
#include "client/study/study_scene.h"

namespace vantage::study {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr size_t kTermsPerLine = 12;  // LP readers have short lines
constexpr double kGrace = 10;         // s until a solver that goes on after its time is ended
constexpr auto kPollSolver = std::chrono::milliseconds(20);

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
  const size_t words = problem.sets.empty() ? 0 : problem.sets.front().size();
  for (size_t element = 0; element < words * 64; ++element) {
    if (problem.start && Contains(problem.sets[*problem.start], element)) continue;
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

// 'If `chosen` is taken, and `and_chosen` where there is one, then one of these is taken': the
// constraint that keeps a solution connected.
struct Cut {
  size_t chosen = 0;
  std::optional<size_t> and_chosen;
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
  absl::StrAppend(&lp, objective.text(), "\nSubject To\n");
  if (problem.start) absl::StrAppend(&lp, " start: x", *problem.start, " = 1\n");
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
    if (cuts[k].and_chosen) cut.Add(absl::StrCat("+ x", *cuts[k].and_chosen));
    for (const size_t i : cuts[k].one_of) cut.Add(absl::StrCat("- x", i));
    absl::StrAppend(&lp, " k", k, ":", cut.text(), cuts[k].and_chosen ? "<= 1\n" : "<= 0\n");
  }
  absl::StrAppend(&lp, "Bounds\n", bounds, "Binary", binaries.text(), "\nEnd\n");
  return lp;
}

// Ends the program after `seconds`, which is no error: what it wrote until then counts.
absl::Status RunQuietly(const std::vector<std::string>& arguments, double seconds) {
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
  const auto begun = Clock::now();
  int status = 0;
  bool ended = false;
  while (true) {
    const pid_t met = ::waitpid(pid, &status, ended ? 0 : WNOHANG);
    if (met == pid) break;
    if (met < 0 && errno != EINTR) return absl::InternalError("the solver went away");
    if (met == 0 && std::chrono::duration<double>(Clock::now() - begun).count() > seconds) {
      ::kill(pid, SIGKILL);
      ended = true;
    } else if (met == 0) {
      std::this_thread::sleep_for(kPollSolver);
    }
  }
  if (!ended && !WIFEXITED(status)) {
    return absl::InternalError(absl::StrCat(arguments[0], " was killed"));
  }
  return absl::OkStatus();
}

// The solver's answer: whether it is proved, and the variables that are 1.
struct Answer {
  bool optimal = false;
  bool infeasible = false;
  std::set<size_t> chosen;
};

Answer ReadAnswer(const std::string& path) {
  Answer answer;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (absl::StartsWith(line, "Optimal") || absl::StrContains(line, "INTEGER OPTIMAL")) {
      answer.optimal = true;
    }
    if (absl::StrContains(line, "nfeasible") || absl::StrContains(line, "EMPTY")) {
      answer.infeasible = true;
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

// A choice in the form of CBC's solutions.
std::string StartOf(const std::vector<size_t>& known) {
  std::string text = absl::StrCat("Stopped on time - objective value ", known.size(), "\n");
  for (size_t k = 0; k < known.size(); ++k) absl::StrAppend(&text, k, " x", known[k], " 1 0\n");
  return text;
}

absl::StatusOr<Answer> Solve(const std::string& program, double seconds,
                             const std::vector<size_t>& known) {
  const std::string solver = FindCoverSolver();
  if (solver.empty()) {
    return client::WithFix(
        absl::FailedPreconditionError("no integer programming solver is on PATH"),
        "install coinor-cbc or glpk-utils");
  }
  const Scratch scratch;
  if (!scratch.made()) return absl::PermissionDeniedError("cannot make a folder for the solver");
  const std::string model = scratch.File("model.lp");
  const std::string start = scratch.File("start.txt");
  const std::string out = scratch.File("out.txt");
  std::ofstream(model) << program;
  std::ofstream(start) << StartOf(known);
  const std::string limit = absl::StrCat(std::max(1, static_cast<int>(seconds)));
  std::vector<std::string> arguments = {solver, "--lp", model, "--tmlim", limit, "-o", out};
  if (fs::path(solver).filename() == "cbc") {
    arguments = {solver, model};
    if (!known.empty()) arguments.insert(arguments.end(), {"mipstart", start});
    arguments.insert(arguments.end(),
                     {"timeMode", "elapsed", "sec", limit, "solve", "solution", out});
  }
  if (absl::Status run = RunQuietly(arguments, seconds + kGrace); !run.ok()) return run;
  return ReadAnswer(out);
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

bool Covers(const CoverProblem& problem, const std::set<size_t>& chosen) {
  simulation::SampleSet covered(problem.sets.front().size(), 0);
  for (const size_t i : chosen) AddTo(covered, problem.sets[i]);
  return CountOf(covered) >= problem.goal;
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
  for (const size_t i : component) {
    cuts.push_back({i, std::nullopt, {around.begin(), around.end()}});
  }
  return cuts;
}

// The same where any candidate may be the first: members of this component and of the main one are
// not both taken unless a neighbour of this one is.
std::vector<Cut> CutsBetween(const CoverProblem& problem, const std::vector<size_t>& component,
                             const std::vector<size_t>& main) {
  std::vector<Cut> cuts;
  for (const Cut& cut : CutsFor(problem, component)) {
    for (const size_t i : main) cuts.push_back({cut.chosen, i, cut.one_of});
  }
  return cuts;
}

}  // namespace

std::string FindCoverSolver() {
  const std::string cbc = FindOnPath("cbc");
  return cbc.empty() ? FindOnPath("glpsol") : cbc;
}

absl::StatusOr<CoverAnswer> SolveCover(const CoverProblem& problem, double seconds,
                                       const std::vector<size_t>& known) {
  const auto begun = Clock::now();
  const size_t done = problem.start ? CountOf(problem.sets[*problem.start]) : 0;
  CoverAnswer answer;
  if (done >= problem.goal) {
    if (problem.start) answer.route.push_back(*problem.start);
    answer.proven = true;
    return answer;
  }
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
    const auto solved =
        Solve(WriteProgram(problem, classes, problem.goal - done, cuts), left, known);
    if (!solved.ok()) return solved.status();
    std::set<size_t> chosen = solved->chosen;
    if (problem.start) chosen.insert(*problem.start);
    // A solver whose time ends may write the relaxed problem's values for want of a solution.
    if (!Covers(problem, chosen)) {
      return solved->infeasible
                 ? absl::FailedPreconditionError("no positions that hang together reach the goal")
                 : absl::DeadlineExceededError(
                       absl::StrFormat("the solver found nothing within %.0f s", left));
    }
    std::vector<size_t> route = Component(problem, chosen, problem.start.value_or(*chosen.begin()));
    if (route.size() == chosen.size()) {
      answer.route = std::move(route);
      answer.proven = solved->optimal;
      return answer;
    }
    std::set<size_t> apart = chosen;
    for (const size_t i : route) apart.erase(i);
    while (!apart.empty()) {
      const std::vector<size_t> component = Component(problem, apart, *apart.begin());
      const std::vector<Cut> more =
          problem.start ? CutsFor(problem, component) : CutsBetween(problem, component, route);
      cuts.insert(cuts.end(), more.begin(), more.end());
      for (const size_t i : component) apart.erase(i);
    }
  }
}

}  // namespace vantage::study
