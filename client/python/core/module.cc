// vantage_core: the planner itself for Debian's Python, on arrays and without a server. What it
// does is said in the headers that it includes; README.md beside it has an example.
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/model/partial_model.h"
#include "core/model/view/export.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/planner.h"
#include "core/registration/first_pose.h"
#include "core/registration/levelling.h"
#include "core/registration/place_and_register.h"
#include "core/sensor/confined_scan_file.h"
#include "core/sensor/encoding.h"
#include "core/sensor/scan.h"

namespace py = pybind11;

namespace vantage::python {
namespace {

// Of any kind that NumPy can convert; memory in rows.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

// A status as Python's own exceptions: what a caller did wrong, what is not there, what does not
// fit into memory, and the rest.
[[noreturn]] void Raise(const absl::Status& status) {
  const std::string text(status.message());
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kUnimplemented:
      throw py::value_error(text);
    case absl::StatusCode::kNotFound:
      throw py::key_error(text);
    case absl::StatusCode::kResourceExhausted:
      PyErr_SetString(PyExc_MemoryError, text.c_str());
      throw py::error_already_set();
    default:
      throw std::runtime_error(text);
  }
}

template <typename T>
T OrRaise(absl::StatusOr<T> result) {
  if (!result.ok()) Raise(result.status());
  return *std::move(result);
}

// Work that takes long, while other threads of Python run.
template <typename Work>
auto Unlocked(Work&& work) {
  const py::gil_scoped_release release;
  return work();
}

Eigen::Isometry3d PoseOf(const Eigen::Matrix4d& T, const char* name) {
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if (!T.allFinite() || !(R * R.transpose()).isIdentity(1e-6) || R.determinant() < 0 ||
      !T.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1))) {
    throw py::value_error(absl::StrCat(name, ": not rigid; it is (4, 4), scanner to world, m"));
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = R;
  pose.translation() = T.topRightCorner<3, 1>();
  return pose;
}

// An image of ours, or anything with its attributes: so also a vantage.RangeImage of the client.
sensor::RangeImage ImageOf(const py::object& given) {
  const auto axis = [&](const char* name) {
    const Doubles values = py::cast<Doubles>(given.attr(name));
    if (values.ndim() != 1) throw py::value_error(absl::StrCat(name, ": not a row of angles"));
    return std::vector<double>(values.data(), values.data() + values.size());
  };
  sensor::RangeImage image;
  image.azimuth = axis("azimuth");
  image.elevation = axis("elevation");
  const Floats ranges = py::cast<Floats>(given.attr("ranges"));
  if (ranges.ndim() != 2 || ranges.shape(0) != image.rows() || ranges.shape(1) != image.columns()) {
    throw py::value_error("ranges: its shape is not (rows, columns) of elevation and azimuth");
  }
  image.range.resize(image.cells());
  for (int row = 0; row < image.rows(); ++row) {
    for (int column = 0; column < image.columns(); ++column) {
      image.range[image.Index(column, row)] = ranges.at(row, column);
    }
  }
  image.full_turn = py::cast<bool>(given.attr("full_turn"));
  image.native_azimuth_step = py::cast<double>(given.attr("native_azimuth_step"));
  image.native_elevation_step = py::cast<double>(given.attr("native_elevation_step"));
  if (absl::Status valid = image.Validate(); !valid.ok()) Raise(valid);
  return image;
}

py::array_t<float> RangesOf(const sensor::RangeImage& image) {
  py::array_t<float> ranges({image.rows(), image.columns()});
  auto to = ranges.mutable_unchecked<2>();
  for (int row = 0; row < image.rows(); ++row) {
    for (int column = 0; column < image.columns(); ++column) {
      to(row, column) = image.at(column, row);
    }
  }
  return ranges;
}

sensor::Scan ScanOf(const py::object& image, const sensor::ScannerModel& scanner) {
  return {ImageOf(image), scanner, std::nullopt};
}

// A scanner that makes such images; range interval and noise are the defaults.
sensor::ScannerModel ScannerOf(const py::object& given) {
  return sensor::ImportImage(ImageOf(given), {}).scanner;
}

// Columns of what is known of each voxel that is not unknown, or that has area.
struct Voxels {
  py::array_t<double> centre;
  py::array_t<uint8_t> state;
  py::array_t<float> density;
};

class Model {
 public:
  Model(double voxel_size, int threads) : threads_(std::max(1, threads)) {
    model::ModelConfig config;
    config.voxel_size = voxel_size;
    model_ = OrRaise(model::PartialModel::Create(config));
  }

  model::MergeReport Insert(const std::string& id, const py::object& image,
                            const sensor::ScannerModel& scanner, const Eigen::Matrix4d& T) {
    const sensor::Scan scan = ScanOf(image, scanner);
    const Eigen::Isometry3d pose = PoseOf(T, "T_world_scan");
    return OrRaise(Unlocked([&] {
      const std::lock_guard lock(mutex_);
      return model_->Insert(id, scan, pose, threads_);
    }));
  }

  model::MergeReport Withdraw(const std::string& id) {
    return OrRaise(Unlocked([&] {
      const std::lock_guard lock(mutex_);
      return model_->Withdraw(id, threads_);
    }));
  }

  std::shared_ptr<const model::PlanningView> View() const {
    const std::lock_guard lock(mutex_);
    return model_->Publish();
  }

  registration::RegistrationResult Register(const py::object& image,
                                            const sensor::ScannerModel& scanner,
                                            const std::optional<Eigen::Matrix4d>& prior,
                                            const std::optional<sensor::Matrix6d>& covariance) {
    sensor::Scan scan = ScanOf(image, scanner);
    if (prior) {
      scan.prior.emplace();
      scan.prior->T_world_scan = PoseOf(*prior, "prior");
      scan.prior->covariance = covariance;
    } else if (covariance) {
      throw py::value_error("covariance: of what? a prior goes with it");
    }
    return OrRaise(Unlocked([&] {
      const auto view = View();
      Eigen::Isometry3d last = Eigen::Isometry3d::Identity();
      if (!view->stations().empty()) last.translation() = view->stations().back().position;
      return registration::PlaceAndRegister(*view, scan, last, {}, {}, threads_);
    }));
  }

  planning::Plan Plan(const sensor::ScannerModel& scanner, const planning::PlanningConfig& config,
                      std::optional<double> seconds, std::optional<uint64_t> work_limit_rays,
                      const std::function<bool(const planning::Plan&)>& progress) {
    if (seconds.has_value() == work_limit_rays.has_value()) {
      throw py::value_error("seconds, work_limit_rays: a plan has one budget");
    }
    std::exception_ptr failure;
    auto plan = Unlocked([&] {
      std::stop_source cancelled;
      parallel::Budget budget =
          seconds ? parallel::Budget::Seconds(*seconds) : parallel::Budget::Unlimited();
      if (work_limit_rays) budget.work_limit = *work_limit_rays;
      budget.cancelled = cancelled.get_token();
      return planning::MakePlan(*View(), scanner, config, budget, threads_,
                                [&](const planning::Plan& now) {
                                  if (!progress || cancelled.stop_requested()) return;
                                  const py::gil_scoped_acquire acquire;
                                  try {
                                    if (!progress(now)) cancelled.request_stop();
                                  } catch (...) {
                                    // It ends in the thread that it is planned in, not here.
                                    failure = std::current_exception();
                                    cancelled.request_stop();
                                  }
                                });
    });
    if (failure) std::rethrow_exception(failure);
    return OrRaise(std::move(plan));
  }

  Voxels Known() const {
    const auto view = View();
    std::vector<std::array<double, 3>> centres;
    std::vector<uint8_t> states;
    std::vector<float> densities;
    for (const model::BrickAt& at : view->bricks()) {
      for (int local = 0; local < model::Brick::kVoxels; ++local) {
        const model::VoxelState state = at.contents->state[local];
        if (state == model::VoxelState::kUnknown) continue;
        const Eigen::Vector3d p = view->Centre(model::PlanningView::Global(at.brick, local));
        centres.push_back({p.x(), p.y(), p.z()});
        states.push_back(static_cast<uint8_t>(state));
        const auto surface = at.contents->Surface(local);
        densities.push_back(surface ? static_cast<float>(surface->density) : 0.0f);
      }
    }
    const auto count = static_cast<py::ssize_t>(centres.size());
    Voxels voxels{py::array_t<double>({count, py::ssize_t{3}}), py::array_t<uint8_t>(count),
                  py::array_t<float>(count)};
    if (count > 0) {
      std::memcpy(voxels.centre.mutable_data(), centres.data(),
                  centres.size() * sizeof(centres[0]));
      std::memcpy(voxels.state.mutable_data(), states.data(), states.size());
      std::memcpy(voxels.density.mutable_data(), densities.data(),
                  densities.size() * sizeof(float));
    }
    return voxels;
  }

  py::bytes Ply() const {
    const std::string ply = Unlocked([&] { return model::ExportSurfacePly(*View()); });
    return py::bytes(ply);
  }

 private:
  mutable std::mutex mutex_;  // guards model_, which is changed by one caller at a time
  mutable parallel::ThreadPool threads_;
  std::unique_ptr<model::PartialModel> model_;
};

py::tuple Read(const std::string& path, size_t setup) {
  auto read = Unlocked([&]() -> absl::StatusOr<sensor::ImportedScan> {
    auto file = sensor::ScanFile::Open(path);
    if (!file.ok()) return file.status();
    if (setup >= file->setups().size()) {
      return absl::OutOfRangeError(absl::StrCat("setup: ", setup, ", but ", path, " has ",
                                                file->setups().size(), ", from 0"));
    }
    return file->Read(setup, {});
  });
  sensor::ImportedScan scan = OrRaise(std::move(read));
  py::object pose = py::none();
  if (scan.T_world_scan) pose = py::cast(Eigen::Matrix4d(scan.T_world_scan->matrix()));
  return py::make_tuple(std::move(scan.image), scan.scanner, pose);
}

Eigen::Matrix4d Level(const py::object& image, const sensor::ScannerModel& scanner) {
  const sensor::Scan scan = ScanOf(image, scanner);
  const auto levelled = OrRaise(Unlocked([&] { return registration::LevelFirstScan(scan); }));
  return levelled.T_world_scan.matrix();
}

void DefineImage(py::module_& module) {
  using sensor::RangeImage;
  using sensor::ScannerModel;
  py::class_<RangeImage>(module, "RangeImage", "Ranges along a grid of rays, scanner's frame.")
      .def_readonly("azimuth", &RangeImage::azimuth, "columns, rad, rising")
      .def_readonly("elevation", &RangeImage::elevation, "rows, rad, rising")
      .def_property_readonly("ranges", &RangesOf,
                             "(rows, columns) float32, m, row 0 the lowest; 0: no return, -1: not "
                             "measured")
      .def_readonly("full_turn", &RangeImage::full_turn)
      .def_readonly("native_azimuth_step", &RangeImage::native_azimuth_step, "rad")
      .def_readonly("native_elevation_step", &RangeImage::native_elevation_step, "rad")
      .def_static(
          "from_bytes",
          [](const py::bytes& bytes) {
            const std::string_view view(bytes);
            return OrRaise(sensor::DecodeRangeImage(absl::string_view(view.data(), view.size()),
                                                    size_t{1} << 28));
          },
          "Of its encoding. ValueError: it is none.")
      .def("to_bytes",
           [](const RangeImage& image) { return py::bytes(sensor::EncodeRangeImage(image)); });
  py::class_<ScannerModel> scanner(module, "Scanner", "What a scanner can measure.");
  scanner.def(py::init<>())
      .def_static("of", &ScannerOf,
                  "One that makes such images: spans and steps; the rest by default.",
                  py::arg("image"));
  const auto figure = [&](const char* name, double ScannerModel::*member, const char* unit) {
    scanner.def_readwrite(name, member, unit);
  };
  figure("azimuth_span", &ScannerModel::azimuth_span, "rad, centred on its +x");
  figure("elevation_min", &ScannerModel::elevation_min, "rad");
  figure("elevation_max", &ScannerModel::elevation_max, "rad");
  figure("azimuth_step", &ScannerModel::azimuth_step, "rad, native");
  figure("elevation_step", &ScannerModel::elevation_step, "rad, native");
  figure("range_min", &ScannerModel::range_min, "m");
  figure("range_max", &ScannerModel::range_max, "m");
  figure("range_noise", &ScannerModel::range_noise, "m, one sigma");
  figure("range_noise_ppm", &ScannerModel::range_noise_ppm, "1e-6 of the range, one sigma");
  figure("max_incidence", &ScannerModel::max_incidence, "rad");
  figure("clearance", &ScannerModel::clearance, "m, kept free around it");
  figure("positioning_error", &ScannerModel::positioning_error, "m, per axis");
}

void DefineModel(py::module_& module) {
  py::enum_<model::VoxelState>(module, "VoxelState")
      .value("UNKNOWN", model::VoxelState::kUnknown)
      .value("EMPTY", model::VoxelState::kEmpty)
      .value("TRUE_SURFACE", model::VoxelState::kTrueSurface)
      .value("ABSORBED", model::VoxelState::kAbsorbed)
      .value("FALSE_OCCLUSION", model::VoxelState::kFalseOcclusion)
      .value("FALSE_HOLE", model::VoxelState::kFalseHole)
      .value("FALSE_IMAGE", model::VoxelState::kFalseImage);
  py::class_<model::MergeReport>(module, "MergeReport", "What merging a scan did.")
      .def_readonly("version", &model::MergeReport::version)
      .def_readonly("samples", &model::MergeReport::samples)
      .def_readonly("empty_voxels", &model::MergeReport::empty_voxels)
      .def_readonly("surface_voxels", &model::MergeReport::surface_voxels)
      .def_readonly("changed_bricks", &model::MergeReport::changed_bricks);
  py::class_<Voxels>(module, "Voxels", "Columns of all voxels that are not unknown.")
      .def_readonly("centre", &Voxels::centre, "(voxels, 3) float64, m, world")
      .def_readonly("state", &Voxels::state, "(voxels,) uint8, a VoxelState")
      .def_readonly("density", &Voxels::density,
                    "(voxels,) float32, samples / m^2; 0 where it is no surface");
  py::class_<Model>(module, "Model",
                    "What is known of a site. Other threads run while it works; one at a time "
                    "changes it.")
      .def(py::init<double, int>(), py::arg("voxel_size") = 0.05, py::arg("threads") = 2)
      .def("insert", &Model::Insert, py::arg("id"), py::arg("image"), py::arg("scanner"),
           py::arg("T_world_scan"),
           "Carves and merges a scan at a pose, (4, 4) scanner to world, m. ValueError: the id is "
           "taken, or the image is not valid.")
      .def("withdraw", &Model::Withdraw, py::arg("id"),
           "The model as if the scan had never come. KeyError: it is not in it.")
      .def("register", &Model::Register, py::arg("image"), py::arg("scanner"),
           py::arg("prior") = py::none(), py::arg("covariance") = py::none(),
           "Aligns a scan. prior: (4, 4); without one the site is searched. covariance: (6, 6) "
           "[rotation about the world's axes, rad; translation, m]; without one the prior is a "
           "guess. A bad alignment is no error: `outcome` says so. ValueError: the model is empty.")
      .def("plan", &Model::Plan, py::arg("scanner"), py::arg("config"),
           py::arg("seconds") = py::none(), py::arg("work_limit_rays") = py::none(),
           py::arg("progress") = nullptr,
           "Where to stand next, within one of the budgets. progress(plan) is called with better "
           "rankings; False ends the plan with what it has. ValueError: the configuration is not "
           "possible.")
      .def("voxels", &Model::Known)
      .def("surface_ply", &Model::Ply, "Surface voxels as a PLY file.")
      .def_property_readonly("version", [](const Model& model) { return model.View()->version(); })
      .def_property_readonly("voxel_size",
                             [](const Model& model) { return model.View()->voxel_size(); });
}

void DefineRegistration(py::module_& module) {
  using registration::RegistrationOutcome;
  using registration::RegistrationResult;
  py::enum_<RegistrationOutcome>(module, "Outcome")
      .value("REGISTERED", RegistrationOutcome::kRegistered)
      .value("DOUBTFUL", RegistrationOutcome::kDoubtful)
      .value("FAILED", RegistrationOutcome::kFailed);
  py::class_<RegistrationResult>(module, "Registration", "An alignment and its evidence.")
      .def_property_readonly(
          "T_world_scan",
          [](const RegistrationResult& r) { return Eigen::Matrix4d(r.T_world_scan.matrix()); },
          "(4, 4) float64, m")
      .def_readonly("covariance", &RegistrationResult::covariance,
                    "(6, 6), [rotation, rad; translation, m] about `centroid`")
      .def_readonly("centroid", &RegistrationResult::centroid, "(3,), m, world")
      .def_readonly("rms_residual", &RegistrationResult::rms_residual, "m")
      .def_property_readonly("outcome",
                             [](const RegistrationResult& r) { return r.verdict.outcome; })
      .def_property_readonly("overlap",
                             [](const RegistrationResult& r) { return r.verdict.overlap_share; })
      .def_property_readonly(
          "error_bound", [](const RegistrationResult& r) { return r.verdict.error_bound; },
          "m, 95 %")
      .def_property_readonly("reason", [](const RegistrationResult& r) { return r.verdict.reason; })
      .def_property_readonly("remedy",
                             [](const RegistrationResult& r) { return r.verdict.remedy; });
}

void DefinePlanning(py::module_& module) {
  using planning::PlanningConfig;
  using planning::RankedView;
  py::class_<PlanningConfig>(module, "PlanningConfig", "What is required, and where one may stand.")
      .def(py::init<>())
      .def_readwrite("required_density", &PlanningConfig::required_density, "samples / m^2")
      .def_readwrite("viewcell_size", &PlanningConfig::viewcell_size, "m")
      .def_readwrite("min_viewpoint_height", &PlanningConfig::min_viewpoint_height, "m")
      .def_readwrite("max_viewpoint_height", &PlanningConfig::max_viewpoint_height, "m")
      .def_readwrite("require_reachable", &PlanningConfig::require_reachable)
      .def_readwrite("candidates", &PlanningConfig::candidates, "views at most")
      .def_readwrite("terminate_below", &PlanningConfig::terminate_below, "m^2")
      .def_readwrite("seed", &PlanningConfig::seed);
  py::class_<RankedView>(module, "View", "A place for the next scan.")
      .def_readonly("position", &RankedView::position, "(3,), m, world")
      .def_readonly("heading", &RankedView::heading, "rad; None: it makes no difference")
      .def_readonly("score", &RankedView::score, "weighted samples")
      .def_readonly("score_lower", &RankedView::lower)
      .def_readonly("score_upper", &RankedView::upper)
      .def_readonly("model_gain", &RankedView::model_gain,
                    "m^2 brought to density; None: not exact")
      .def_readonly("expected_gain", &RankedView::expected_gain, "m^2")
      .def_readonly("clearance", &RankedView::clearance, "m")
      .def_property_readonly("registers",
                             [](const RankedView& view) { return view.verdict.registered(); })
      .def_property_readonly(
          "error_bound", [](const RankedView& view) { return view.verdict.error_bound; }, "m")
      .def_property_readonly("remedy", [](const RankedView& view) { return view.verdict.remedy; })
      .def_property_readonly("description",
                             [](const RankedView& view) { return view.location.description; });
  py::class_<planning::Plan>(module, "Plan", "Views, best first, and whether to stop.")
      .def_readonly("views", &planning::Plan::views)
      .def_readonly("refused", &planning::Plan::refused, "the best that would not register")
      .def_readonly("message", &planning::Plan::message)
      .def_readonly("complete", &planning::Plan::complete, "every view was scored exactly")
      .def_readonly("rays", &planning::Plan::rays)
      .def_property_readonly("stop",
                             [](const planning::Plan& plan) { return plan.termination.suggested; })
      .def_property_readonly(
          "score_map",
          [](const planning::Plan& plan) {
            const auto count = static_cast<py::ssize_t>(plan.score_map.size());
            py::array_t<float> map({count, py::ssize_t{4}});
            auto to = map.mutable_unchecked<2>();
            for (py::ssize_t i = 0; i < count; ++i) {
              const planning::ScoredCell& cell = plan.score_map[static_cast<size_t>(i)];
              for (int axis = 0; axis < 3; ++axis) to(i, axis) = cell.centre[axis];
              to(i, 3) = cell.score;
            }
            return map;
          },
          "(cells, 4) float32: x, y, z, m, world, and score, weighted samples");
}

}  // namespace
}  // namespace vantage::python

PYBIND11_MODULE(vantage_core, module) {
  using namespace vantage::python;  // NOLINT(google-build-using-namespace)
  module.doc() =
      "The planner of scanner positions without a server: carve, register and plan on arrays. "
      "Metres, radians, right-handed frames with z up.";
  module.attr("__version__") = VANTAGE_VERSION;
  DefineImage(module);
  DefineModel(module);
  DefineRegistration(module);
  DefinePlanning(module);
  module.def(
      "read", &Read, py::arg("path"), py::arg("setup") = 0,
      "(image, scanner, T_world_scan or None) of a file's set-up: E57, PTX, PCD, LAS, PLY or "
      "an encoded image. It is read in this process: give it files that you trust.");
  module.def("level", &Level, py::arg("image"), py::arg("scanner"),
             "(4, 4) scanner to world of a first scan: z up, the scanner at the origin.");
}
