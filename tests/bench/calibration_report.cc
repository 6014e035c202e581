#include "tests/bench/calibration_report.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/bench/calibration_real.h"

namespace vantage::bench {
namespace {

// The errors of priors that an alignment must correct, and the accuracy that it must reach.
constexpr double kPriorMetres = 0.3;
constexpr double kPriorDegrees = 10;
constexpr double kExactMetres = 0.003;
constexpr double kExactDegrees = 0.05;
constexpr double kLeastError = 1e-5;  // m; the least achieved error that is divided by

struct Tally {
  size_t pairs = 0;
  size_t accurate = 0;
  size_t predicted_held = 0;
  size_t held = 0;
  size_t registered = 0;
  size_t registered_accurate = 0;
  size_t foreseen = 0;           // predicted to register
  size_t foreseen_accurate = 0;  // and accurate
  std::vector<double> predicted_ratio;
  std::vector<double> ratio;
  std::vector<double> seconds;

  void Add(const CalibrationPair& p, const registration::RegistrationConfig& config) {
    const bool good = p.Accurate(config);
    const bool taken = p.outcome == registration::RegistrationOutcome::kRegistered;
    const bool foretold = p.predicted == registration::RegistrationOutcome::kRegistered;
    ++pairs;
    accurate += good ? 1 : 0;
    predicted_held += p.achieved <= p.predicted_bound ? 1 : 0;
    held += p.achieved <= p.bound ? 1 : 0;
    registered += taken ? 1 : 0;
    registered_accurate += taken && good ? 1 : 0;
    foreseen += foretold ? 1 : 0;
    foreseen_accurate += foretold && good ? 1 : 0;
    predicted_ratio.push_back(p.predicted_bound / std::max(kLeastError, p.achieved));
    ratio.push_back(p.bound / std::max(kLeastError, p.achieved));
    seconds.push_back(p.seconds);
  }
};

double Share(size_t part, size_t all) {
  return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all);
}

const char* Words(registration::RegistrationOutcome outcome) {
  switch (outcome) {
    case registration::RegistrationOutcome::kRegistered:
      return "registered";
    case registration::RegistrationOutcome::kDoubtful:
      return "doubtful";
    case registration::RegistrationOutcome::kFailed:
      return "failed";
  }
  return "";
}

// --- The picture

constexpr double kSide = 460;  // px, of a panel
constexpr double kLeft = 70;
constexpr double kTop = 60;
constexpr double kGap = 80;
constexpr double kFrom = 1e-4;  // m, both axes
constexpr double kTo = 30;

double Along(double metres) {
  return std::log(std::clamp(metres, kFrom, kTo) / kFrom) / std::log(kTo / kFrom);
}

void Panel(double left, const std::string& title, const std::vector<CalibrationPair>& pairs,
           bool predicted, const registration::RegistrationConfig& config, std::string& out) {
  const auto x_of = [&](double m) { return left + kSide * Along(m); };
  const auto y_of = [&](double m) { return kTop + kSide * (1 - Along(m)); };
  absl::StrAppendFormat(&out, "<text x=\"%g\" y=\"%g\">%s</text>\n", left, kTop - 12, title);
  for (double decade = kFrom; decade < 1.01 * kTo; decade *= 10) {
    const std::string label =
        decade < 0.9 ? absl::StrFormat("%g mm", 1000 * decade) : absl::StrFormat("%g m", decade);
    absl::StrAppendFormat(&out,
                          "<path d=\"M%.1f %g V%g M%g %.1f H%g\" stroke=\"#ddd\"/>\n"
                          "<text x=\"%.1f\" y=\"%g\" text-anchor=\"middle\">%s</text>\n"
                          "<text x=\"%g\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n",
                          x_of(decade), kTop, kTop + kSide, left, y_of(decade), left + kSide,
                          x_of(decade), kTop + kSide + 15, label, left - 5, y_of(decade) + 4,
                          label);
  }
  absl::StrAppendFormat(
      &out,
      "<rect x=\"%g\" y=\"%g\" width=\"%g\" height=\"%g\" fill=\"none\" stroke=\"#888\"/>\n"
      "<path d=\"M%g %g L%g %g\" stroke=\"#444\"/>\n"
      "<path d=\"M%.1f %g V%g M%g %.1f H%g\" stroke=\"#444\" stroke-dasharray=\"4 4\"/>\n"
      "<text x=\"%g\" y=\"%g\" text-anchor=\"middle\">bound E</text>\n",
      left, kTop, kSide, kSide, left, kTop + kSide, left + kSide, kTop,
      x_of(config.required_accuracy), kTop, kTop + kSide, left, y_of(config.required_accuracy),
      left + kSide, left + 0.5 * kSide, kTop + kSide + 32);
  for (const CalibrationPair& p : pairs) {
    const registration::RegistrationOutcome outcome = predicted ? p.predicted : p.outcome;
    const char* colour = outcome == registration::RegistrationOutcome::kRegistered ? "#0072b2"
                         : outcome == registration::RegistrationOutcome::kDoubtful ? "#e69f00"
                                                                                   : "#d55e00";
    absl::StrAppendFormat(&out,
                          "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2\" fill=\"%s\" "
                          "fill-opacity=\"0.5\"/>\n",
                          x_of(predicted ? p.predicted_bound : p.bound), y_of(p.achieved), colour);
  }
}

}  // namespace

double LowerLimit95(size_t good, size_t all) {
  if (good == 0 || all == 0) return 0;
  // The share at which as many good ones as were seen, or more, come in 5 % of cases.
  const auto n = static_cast<double>(all);
  double low = 0;
  double high = 1;
  for (int step = 0; step < 60; ++step) {
    const double p = 0.5 * (low + high);
    double tail = 0;
    for (size_t k = good; k <= all; ++k) {
      const auto x = static_cast<double>(k);
      tail += std::exp(std::lgamma(n + 1) - std::lgamma(x + 1) - std::lgamma(n - x + 1) +
                       x * std::log(p) + (n - x) * std::log1p(-p));
    }
    (tail > 0.05 ? high : low) = p;
  }
  return low;
}

void ReportCalibration(const std::vector<CalibrationPair>& pairs,
                       const registration::RegistrationConfig& config, Figures& figures) {
  Tally all;
  size_t degenerate = 0;
  for (const CalibrationPair& p : pairs) {
    all.Add(p, config);
    degenerate += p.degenerate ? 1 : 0;
  }
  if (all.pairs == 0) return;
  const std::string of = absl::StrFormat(
      "%d simulated pairs, %.0f %% degenerate by construction, %.0f %% end within "
      "%g mm",
      all.pairs, 100 * Share(degenerate, all.pairs), 100 * Share(all.accurate, all.pairs),
      1000 * config.required_accuracy);
  figures.Add({"predict.coverage95", 100 * Share(all.predicted_held, all.pairs), "%", "93 to 99.7",
               absl::StrCat("predicted E against what the scan's alignment came to; ", of)});
  figures.Add({"predict.looseness", Percentile(all.predicted_ratio, 0.5), "times", "3",
               "median of predicted E over achieved error, all pairs"});
  figures.Add(
      {"predict.precision", 100 * Share(all.foreseen_accurate, all.foreseen), "%", "",
       absl::StrFormat("of %d predicted to register, those that end accurate", all.foreseen)});
  figures.Add({"predict.recall", 100 * Share(all.foreseen_accurate, all.accurate), "%", "",
               "of those that end accurate, predicted to register"});
  figures.Add({"qualify.coverage95", 100 * Share(all.held, all.pairs), "%", "93 to 99.7",
               "E of the alignment against what it came to"});
  figures.Add({"qualify.looseness", Percentile(all.ratio, 0.5), "times", "3",
               "median of the alignment's E over achieved error, all pairs"});
  figures.Add(
      {"verdict.precision", 100 * Share(all.registered_accurate, all.registered), "%", "98",
       absl::StrFormat("of %d registered; one-sided 95 %% limit %.2f %%, aim 96", all.registered,
                       100 * LowerLimit95(all.registered_accurate, all.registered))});
  figures.Add({"verdict.recall", 100 * Share(all.registered_accurate, all.accurate), "%", "90",
               absl::StrFormat("of %d that end accurate", all.accurate)});
  size_t near = 0;
  size_t exact = 0;
  for (const CalibrationPair& p : pairs) {
    if (p.degenerate || p.prior_metres > kPriorMetres || p.prior_degrees > kPriorDegrees) continue;
    ++near;
    exact += p.metres <= kExactMetres && p.degrees <= kExactDegrees ? 1 : 0;
  }
  figures.Add(
      {"align.exact", 100 * Share(exact, near), "%", "99",
       absl::StrFormat("of %d pairs in scenes that are not degenerate, from priors up to "
                       "%g m and %g degrees wrong, the scanner within %g mm and %g degrees",
                       near, kPriorMetres, kPriorDegrees, 1000 * kExactMetres, kExactDegrees)});
  figures.Add({"calibrate.align.seconds", Percentile(all.seconds, 0.5), "s", "",
               "median of Register(), one thread of two busy ones"});
}

void PrintFamilies(const std::vector<CalibrationPair>& pairs,
                   const registration::RegistrationConfig& config) {
  std::vector<std::string> order;
  std::map<std::string, Tally> families;
  for (const CalibrationPair& p : pairs) {
    if (!families.contains(p.family)) order.push_back(p.family);
    families[p.family].Add(p, config);
  }
  absl::PrintF("\n%-10s %6s %9s | %9s %6s %10s | %9s %6s %10s %9s %7s\n", "family", "pairs",
               "accurate", "predicted", "loose", "registers", "E holds", "loose", "registered",
               "precision", "recall");
  for (const std::string& name : order) {
    const Tally& t = families[name];
    absl::PrintF("%-10s %6d %7.0f %% | %7.1f %% %6.1f %8.0f %% | %7.1f %% %6.1f %8.0f %% ", name,
                 t.pairs, 100 * Share(t.accurate, t.pairs), 100 * Share(t.predicted_held, t.pairs),
                 Percentile(t.predicted_ratio, 0.5), 100 * Share(t.foreseen, t.pairs),
                 100 * Share(t.held, t.pairs), Percentile(t.ratio, 0.5),
                 100 * Share(t.registered, t.pairs));
    if (t.registered > 0) {
      absl::PrintF("%7.1f %% ", 100 * Share(t.registered_accurate, t.registered));
    } else {
      absl::PrintF("%9s ", "-");
    }
    if (t.accurate > 0) {
      absl::PrintF("%5.0f %%\n", 100 * Share(t.registered_accurate, t.accurate));
    } else {
      absl::PrintF("%7s\n", "-");
    }
  }
}

void PrintInstrument(const std::vector<CalibrationPair>& pairs) {
  size_t said = 0;
  std::map<std::string, int> first;  // by scene: the first pair of which it is said, from 1
  std::vector<double> attainable;
  std::vector<double> promise;
  for (const CalibrationPair& p : pairs) {
    promise.push_back(p.judged / std::max(kLeastError, p.predicted_judged));
    if (p.attainable <= 0) continue;
    ++said;
    attainable.push_back(p.attainable);
    first.try_emplace(absl::StrCat(p.family, p.scene), p.pair + 1);
  }
  absl::PrintF("\nthe judged bound over the predicted one: median %.2f\n",
               promise.empty() ? 0.0 : Percentile(promise, 0.5));
  absl::PrintF("that the instrument cannot: said of %d of %d pairs, in %d scenes", said,
               pairs.size(), first.size());
  if (said > 0) {
    std::vector<double> after;
    after.reserve(first.size());
    for (const auto& [scene, pair] : first) after.push_back(pair);
    absl::PrintF(", first at pair %.0f (median; last %.0f); attainable %.1f mm (median)",
                 Percentile(after, 0.5), Percentile(after, 1), 1000 * Percentile(attainable, 0.5));
  }
  absl::PrintF("\n");
}

void PrintRealPairs(const std::vector<CalibrationPair>& pairs) {
  absl::PrintF("\n%-12s %3s %9s %9s | %9s %9s %8s %8s  %-10s %s\n", "pair", "", "prior off", "",
               "ends off", "", "E", "overlap", "verdict", "decided by");
  size_t accepted = 0;
  size_t wrong = 0;
  for (const CalibrationPair& p : pairs) {
    absl::PrintF("%-12s %3d %7.2f m %5.1f deg | %6.1f mm %5.2f deg %5.1f mm %6.0f %%  %-10s %s\n",
                 p.family, p.pair, p.prior_metres, p.prior_degrees, 1000 * p.metres, p.degrees,
                 1000 * p.bound, 100 * p.overlap, Words(p.outcome), p.decided_by);
    const bool taken = p.outcome == registration::RegistrationOutcome::kRegistered;
    accepted += taken ? 1 : 0;
    wrong += taken && (p.metres > kRealAccuracy || p.degrees > 1.0) ? 1 : 0;
  }
  absl::PrintF("real pairs: %d of %d accepted, %d of them more than %g m or 1 degree off\n",
               accepted, pairs.size(), wrong, kRealAccuracy);
}

bool DrawCalibration(const std::string& path, const std::vector<CalibrationPair>& pairs,
                     const registration::RegistrationConfig& config) {
  const double width = kLeft + 2 * kSide + kGap + 20;
  std::string out = absl::StrFormat(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" "
      "font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%%\" height=\"100%%\" "
      "fill=\"white\"/>\n<text x=\"%g\" y=\"22\" font-size=\"14\">%d simulated pairs: error bound "
      "against achieved error (upwards)</text>\n",
      width, kTop + kSide + 70, kLeft, pairs.size());
  Panel(kLeft, "predicted before the scan", pairs, true, config, out);
  Panel(kLeft + kSide + kGap, "of the alignment", pairs, false, config, out);
  absl::StrAppendFormat(
      &out,
      "<text x=\"%g\" y=\"%g\">blue: registered; yellow: doubtful; red: failed. Below the line the "
      "bound holds; dashed: what is required. Both include the guess of a pose; the verdict does "
      "not.</text>\n</svg>\n",
      kLeft, kTop + kSide + 55);
  std::ofstream file(path);
  file << out;
  return file.good();
}

}  // namespace vantage::bench
