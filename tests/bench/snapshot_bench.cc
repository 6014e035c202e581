// Loading a saved model against building it again from its scans, the same model in the same run.
#include "absl/strings/str_cat.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scan_job.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {

void BenchSnapshot(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("snapshot.")) return;
  constexpr int kScans = 6;
  const ScanJob job = MakeFlatJob(SceneSeeds(options.use).front(), kScans, parallel);
  std::unique_ptr<model::PartialModel> model;
  const double rebuild = MedianSeconds(3, [&] { model = ModelOf(job, kScans, parallel); });
  std::string bytes;
  const double save = MedianSeconds(3, [&] { bytes = model->Save(parallel); });
  constexpr size_t kPlenty = size_t{1} << 32;
  std::unique_ptr<model::PartialModel> loaded;
  const double load = MedianSeconds(
      5, [&] { loaded = model::PartialModel::Load(bytes, kPlenty, parallel).value(); });
  size_t samples = 0;
  for (const sensor::Scan& scan : job.scans) samples += scan.image.SampleCount();
  const std::string what =
      absl::StrCat(kScans, " scans of a flat, ", samples, " samples, ", parallel.width(),
                   " threads", loaded->Digest() == model->Digest() ? "" : "; THE MODELS DIFFER");
  figures.Add({"snapshot.load.seconds", load, "s", "", what});
  figures.Add({"snapshot.load.speedup", rebuild / load, "x", "5",
               "carving and merging the same scans again over loading them"});
  figures.Add({"snapshot.save.seconds", save, "s", "", "the same model"});
  figures.Add({"snapshot.bytes_per_sample", static_cast<double>(bytes.size()) / samples, "B", "",
               absl::StrCat(bytes.size(), " bytes, range images included")});
}

}  // namespace vantage::bench
