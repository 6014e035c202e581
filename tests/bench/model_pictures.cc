// vantage_model_pictures [--out FOLDER]
//
// Draws a level and an upright slice through partial models, voxel by voxel, over what is really
// there: a closed-form scene, the room with windows and a mirror, and, where VANTAGE_SHARED_DATA
// names the real data, a real scan.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/picture/canvas.h"
#include "client/picture/palette.h"
#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/scan_file.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage::bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMargin = 46;     // pixels
constexpr double kHeading = 70;    // pixels
constexpr double kLegend = 62;     // pixels
constexpr double kWidth = 1100;    // pixels
constexpr double kGivenUpInk = 3;  // pixels, side of the dot on what was given up on

const picture::Colour kUnknown = picture::Rgb(0xdcdcdc);
const picture::Colour kAbsorbed = picture::Rgb(0x8c8c8c);
const picture::Colour kTruth = picture::Rgb(0x009e73);
const picture::Colour kGivenUp = picture::Rgb(0xffffff);

picture::Colour ColourOf(model::VoxelState state) {
  switch (state) {
    case model::VoxelState::kUnknown:
      return kUnknown;
    case model::VoxelState::kEmpty:
      return picture::palette::kWhite;
    case model::VoxelState::kTrueSurface:
      return picture::palette::kMeasured;
    case model::VoxelState::kAbsorbed:
      return kAbsorbed;
    case model::VoxelState::kFalseOcclusion:
      return picture::palette::kOcclusion;
    case model::VoxelState::kFalseHole:
      return picture::palette::kHole;
    case model::VoxelState::kFalseImage:
      return picture::palette::kImageBoundary;
  }
  return kUnknown;
}

// A plane through the model across `normal_axis`; its picture has x or y to the right, and y or z
// up.
struct Slice {
  int normal_axis = 2;
  double at = 0;  // m
  int right() const { return normal_axis == 0 ? 1 : 0; }
  int up() const { return normal_axis == 2 ? 1 : 2; }
};

struct Picture {
  std::string title;
  std::string note;
  std::shared_ptr<const model::PlanningView> model;
  Eigen::AlignedBox3d shown;  // m, model frame
  std::vector<Slice> slices;
  // Points (m) of what is really there, within half a voxel of a slice.
  std::function<std::vector<Vector3d>(const Slice&)> truth;
};

class SlicePanel {
 public:
  SlicePanel(const Picture& picture, const Slice& slice, const Vector2d& corner, double scale,
             picture::Canvas& canvas)
      : picture_(picture), slice_(slice), corner_(corner), scale_(scale), canvas_(canvas) {}

  void Draw() const {
    const model::PlanningView& model = *picture_.model;
    const double h = model.voxel_size();
    const model::VoxelIndex low = model.At(picture_.shown.min());
    const model::VoxelIndex high = model.At(picture_.shown.max());
    const int width = high[slice_.right()] - low[slice_.right()] + 1;
    const int height = high[slice_.up()] - low[slice_.up()] + 1;
    picture::Raster raster(width, height);
    std::vector<Vector2d> given_up;
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        model::VoxelIndex v;
        v[slice_.normal_axis] = static_cast<int>(std::floor(slice_.at / h));
        v[slice_.right()] = low[slice_.right()] + i;
        v[slice_.up()] = low[slice_.up()] + j;
        raster.At(i, height - 1 - j) = ColourOf(model.State(v));
        const std::optional<model::SurfaceVoxel> surface = model.Surface(v);
        if (surface.has_value() && surface->given_up) given_up.push_back(On(model.Centre(v)));
      }
    }
    const Vector3d origin = low.cast<double>() * h;
    const Vector3d end = (high.cast<double>().array() + 1) * h;
    const Vector2d top_left(On(origin).x(), On(end).y());
    const Vector2d bottom_right(On(end).x(), On(origin).y());
    canvas_.Image(top_left, bottom_right, raster);
    canvas_.Clip(top_left, bottom_right);
    const Vector2d dot = Vector2d::Constant(0.5 * kGivenUpInk);
    for (const Vector2d& p : given_up) canvas_.FillRectangle(p - dot, p + dot, kGivenUp);
    for (const Vector3d& p : picture_.truth(slice_)) {
      canvas_.FillRectangle(On(p) - Vector2d(0.6, 0.6), On(p) + Vector2d(0.6, 0.6), kTruth);
    }
    int number = 0;
    for (const model::Station& station : model.stations()) {
      const Vector2d p = On(station.position);
      canvas_.FillCircle(p, 9, picture::palette::kWhite);
      canvas_.StrokeCircle(p, 9, 1.5, picture::palette::kInk);
      canvas_.Text(p + Vector2d(0, 4), absl::StrCat(++number), 12, picture::palette::kInk,
                   picture::Align::kCentre, true);
    }
    canvas_.Unclip();
    canvas_.StrokeRectangle(top_left, bottom_right, 1, picture::palette::kFaintInk);
    constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
    canvas_.Text(top_left - Vector2d(0, 8),
                 absl::StrFormat("%s = %.2f m; %s right, %s up", kAxes[slice_.normal_axis],
                                 slice_.at, kAxes[slice_.right()], kAxes[slice_.up()]),
                 14, picture::palette::kInk, picture::Align::kLeft, true);
    const Vector2d bar(top_left.x(), bottom_right.y() + 14);
    canvas_.FillRectangle(bar, bar + Vector2d(scale_, 4), picture::palette::kInk);
    canvas_.Text(bar + Vector2d(scale_ + 6, 6), "1 m", 12, picture::palette::kInk);
  }

 private:
  Vector2d On(const Vector3d& p) const {
    return {corner_.x() + (p[slice_.right()] - picture_.shown.min()[slice_.right()]) * scale_,
            corner_.y() + (picture_.shown.max()[slice_.up()] - p[slice_.up()]) * scale_};
  }

  const Picture& picture_;
  Slice slice_;
  Vector2d corner_;
  double scale_;
  picture::Canvas& canvas_;
};

absl::Status Write(const Picture& picture, const std::string& path) {
  const Vector3d size = picture.shown.sizes();
  double widest = 0;
  for (const Slice& slice : picture.slices) widest = std::max(widest, size[slice.right()]);
  // Whole pixels to the voxel.
  const double h = picture.model->voxel_size();
  const double scale = std::max(1.0, std::floor((kWidth - 2 * kMargin) / widest * h)) / h;
  double height = kHeading;
  for (const Slice& slice : picture.slices) height += size[slice.up()] * scale + kMargin;
  picture::Canvas canvas(static_cast<int>(widest * scale + 2 * kMargin),
                         static_cast<int>(height + kLegend), picture::palette::kWhite);
  canvas.Text({kMargin, 28}, picture.title, 20, picture::palette::kInk, picture::Align::kLeft,
              true);
  canvas.Text({kMargin, 48}, picture.note, 13, picture::palette::kFaintInk);
  double top = kHeading + 10;
  for (const Slice& slice : picture.slices) {
    SlicePanel(picture, slice, {kMargin, top}, scale, canvas).Draw();
    top += size[slice.up()] * scale + kMargin;
  }
  Vector2d at(kMargin, height + 12);
  const auto legend = [&](const picture::Colour& colour, const std::string& text) {
    const double width = 24 + canvas.TextWidth(text, 13) + 18;
    if (at.x() + width > canvas.width() - kMargin) at = {kMargin, at.y() + 22};
    canvas.FillRectangle(at - Vector2d(0, 11), at + Vector2d(18, 2), colour);
    canvas.StrokeRectangle(at - Vector2d(0, 11), at + Vector2d(18, 2), 0.6,
                           picture::palette::kFaintInk);
    canvas.Text(at + Vector2d(24, 0), text, 13, picture::palette::kInk);
    at.x() += width;
  };
  legend(picture::palette::kWhite, "empty");
  legend(kUnknown, "unknown");
  legend(picture::palette::kMeasured, "true surface");
  legend(kAbsorbed, "absorbed");
  legend(picture::palette::kOcclusion, "occlusion");
  legend(picture::palette::kHole, "hole boundary");
  legend(picture::palette::kImageBoundary, "image boundary");
  legend(kGivenUp, "dot: given up");
  legend(kTruth, "what is really there");
  return canvas.WritePng(path);
}

void Insert(const std::string& id, const sensor::Scan& scan, const Eigen::Isometry3d& pose,
            parallel::Parallel& parallel, model::PartialModel& model) {
  (void)model.Insert(id, scan, pose, parallel).value();
}

// Where the air of a closed-form scene ends on a slice.
std::vector<Vector3d> AirEnds(const model::ClosedFormScene& scene, const Eigen::AlignedBox3d& shown,
                              const Slice& slice) {
  constexpr double kStep = 0.01;  // m
  std::vector<Vector3d> ends;
  const int right = slice.right();
  const int up = slice.up();
  Vector3d p;
  p[slice.normal_axis] = slice.at;
  for (double b = shown.min()[up]; b < shown.max()[up]; b += kStep) {
    for (double a = shown.min()[right]; a < shown.max()[right]; a += kStep) {
      p[right] = a;
      p[up] = b;
      const bool here = scene.InAir(p);
      Vector3d beside = p;
      beside[right] += kStep;
      Vector3d above = p;
      above[up] += kStep;
      if (scene.InAir(beside) != here || scene.InAir(above) != here) ends.push_back(p);
    }
  }
  return ends;
}

// Where a slice cuts the triangles of a mesh.
std::vector<Vector3d> Cuts(const simulation::TriangleMesh& mesh, const Slice& slice) {
  constexpr double kStep = 0.01;  // m
  std::vector<Vector3d> points;
  for (const auto& triangle : mesh.triangles) {
    std::vector<Vector3d> ends;
    for (size_t i = 0; i < 3; ++i) {
      const Vector3d a = mesh.vertices[triangle[i]].cast<double>();
      const Vector3d b = mesh.vertices[triangle[(i + 1) % 3]].cast<double>();
      const double da = a[slice.normal_axis] - slice.at;
      const double db = b[slice.normal_axis] - slice.at;
      if ((da < 0) != (db < 0)) ends.push_back(a + (b - a) * (da / (da - db)));
    }
    if (ends.size() != 2) continue;
    const double length = (ends[1] - ends[0]).norm();
    for (double t = 0; t <= length; t += kStep) {
      points.push_back(ends[0] + (ends[1] - ends[0]) * (t / std::max(length, kStep)));
    }
  }
  return points;
}

Picture ClosedForm(parallel::Parallel& parallel) {
  model::ClosedFormScene scene = model::DoorwayRooms();
  scene.air.emplace_back(Vector3d(2.9, -1.4, 0.9), Vector3d(3.2, 0.2, 2.0));
  scene.air.emplace_back(Vector3d(3.15, -100, -100), Vector3d(100, 100, 100));
  scene.solids.push_back({{-1.1, -1.0, 0.6}, {0.3, 0.2, 0.6}});
  Picture picture;
  picture.title = "Two rooms in closed form, one scan";
  picture.note =
      "Doorway in the middle, a box on the left, a window without anything behind it on the right";
  picture.shown = {Vector3d(-3.3, -2.3, -0.2), Vector3d(3.5, 2.3, 2.8)};
  picture.slices = {{2, 1.1}, {1, 0.12}};
  auto model = model::PartialModel::Create({}).value();
  const Eigen::Isometry3d pose = model::PoseAt({-1.6, 0.5, 1.5}, 0.3, 0.01, 0.02);
  Insert("scan", model::ScanScene(scene, pose, {.step = sensor::Radians(0.25), .noise = 0.003}),
         pose, parallel, *model);
  picture.model = model->Publish();
  picture.truth = [scene, shown = picture.shown](const Slice& slice) {
    return AirEnds(scene, shown, slice);
  };
  return picture;
}

Picture Panes(parallel::Parallel& parallel) {
  const simulation::Scene scene = simulation::PaneRoom({true, true, false, false});
  Picture picture;
  picture.title = "The room with two windows and a mirror, three scans";
  picture.note =
      "Windows on the right and above, the mirror below: rays end there, reflections behind it are "
      "gone";
  picture.shown = {Vector3d(-0.5, -0.8, -0.2), Vector3d(5.7, 4.7, 2.8)};
  picture.slices = {{2, 1.3}, {0, 3.0}};
  const simulation::SimulatedScanner simulated(scene.mesh);
  auto model = model::PartialModel::Create({}).value();
  const std::vector<Vector3d> stations = {{0.8, 2.4, 1.5}, {3.3, 2.1, 1.5}, {4.4, 3.0, 1.5}};
  for (size_t i = 0; i < stations.size(); ++i) {
    const Eigen::Isometry3d pose = model::PoseAt(stations[i], 0.3 * static_cast<double>(i));
    sensor::Scan scan;
    scan.image = simulated.Scan(scan.scanner, pose, {}, i + 1, parallel);
    Insert(absl::StrCat("scan", i), scan, pose, parallel, *model);
  }
  picture.model = model->Publish();
  picture.truth = [mesh = scene.mesh](const Slice& slice) { return Cuts(mesh, slice); };
  return picture;
}

absl::StatusOr<Picture> Real(const std::string& file, parallel::Parallel& parallel) {
  const absl::StatusOr<sensor::ImportedScan> imported = sensor::ReadScanFile(file, {});
  if (!imported.ok()) return imported.status();
  sensor::Scan scan{imported->image, imported->scanner, std::nullopt};
  Picture picture;
  picture.title = "A real scan";
  picture.note = "Panoramic scan of a furnished home, 6 cm between samples at 3 m";
  picture.shown = {Vector3d(-4.5, -4.5, -1.6), Vector3d(4.5, 4.5, 1.8)};
  picture.slices = {{2, 0.02}, {1, 0.02}};
  auto model = model::PartialModel::Create({}).value();
  Insert("scan", scan, Eigen::Isometry3d::Identity(), parallel, *model);
  picture.model = model->Publish();
  picture.truth = [image = scan.image, half = picture.model->voxel_size() / 2](const Slice& slice) {
    std::vector<Vector3d> samples;
    for (int c = 0; c < image.columns(); ++c) {
      for (int r = 0; r < image.rows(); ++r) {
        if (!sensor::RangeImage::IsRange(image.at(c, r))) continue;
        const Vector3d p = static_cast<double>(image.at(c, r)) * image.Direction(c, r);
        if (std::abs(p[slice.normal_axis] - slice.at) < half) samples.push_back(p);
      }
    }
    return samples;
  };
  return picture;
}

int Run(const std::string& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) {
    std::cerr << "cannot make the folder " << folder << ": " << failed.message() << "\n";
    return 1;
  }
  parallel::ThreadPool pool(2);
  const auto write = [&](const Picture& picture, const std::string& name) {
    const std::string path = absl::StrCat(folder, "/", name, ".png");
    const absl::Status written = Write(picture, path);
    if (!written.ok()) {
      std::cerr << written << "\n";
      return false;
    }
    std::cout << path << "\n";
    return true;
  };
  if (!write(ClosedForm(pool), "surface-kinds-closed-form")) return 1;
  if (!write(Panes(pool), "surface-kinds-panes")) return 1;
  const char* data = std::getenv("VANTAGE_SHARED_DATA");
  const std::string file =
      absl::StrCat(data == nullptr ? "" : data, "/pcl_room_scan/room_scan1.ptx");
  if (!std::ifstream(file)) {
    std::cout << "no real scan: VANTAGE_SHARED_DATA does not name the folder of the real data\n";
    return 0;
  }
  const absl::StatusOr<Picture> real = Real(file, pool);
  if (!real.ok()) {
    std::cerr << real.status() << "\n";
    return 1;
  }
  return write(*real, "surface-kinds-real-scan") ? 0 : 1;
}

}  // namespace
}  // namespace vantage::bench

int main(int argc, char** argv) {
  CLI::App app("Pictures of the surface kinds in partial models");
  std::string folder = ".";
  app.add_option("--out", folder, "folder to write them to")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return vantage::bench::Run(folder);
}
